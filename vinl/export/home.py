"""A home as files that MuJoCo alone can open: the robot, walls and furniture as MJCF, and episodes to walk in it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from vinl.chain.config import EvaluationConfig
from vinl.chain.episode import EpisodeSetup, draw_routes, draw_setups
from vinl.chain.scene import scene_spec
from vinl.config.errors import InputError
from vinl.config.output import check_out
from vinl.world.boxes import Boxes
from vinl.world.clutter import choose_clutter
from vinl.world.floorplan import FloorPlan

HOME_FILE, EPISODES_FILE = "home.xml", "episodes.json"


def export_home(plan: FloorPlan, out: str | Path, episodes: int = 10, obstacles: str = "paper", seed: int = 0) -> Path:
    """Write a home and episodes in it, the same as those of ``vinl eval``, into a folder: ``home.xml`` holds the robot,
    walls and furniture, and a body ``blocks`` without geoms; ``episodes.json`` the time limit [s] and for each episode
    start, goal [m], yaw, joint angles [rad], the shortest path [m] and blocks as rows of ``Blocks``. Raises
    ``InputError`` if the clutter is unknown, there is no such number of episodes, or the folder cannot be written."""
    folder, clutter = check_out(out), choose_clutter(obstacles, "obstacles")
    if episodes < 1:
        raise InputError(f"episodes must be at least 1, got {episodes}")
    if seed < 0:
        raise InputError(f"seed must not be negative, got {seed}")
    rules = EvaluationConfig()
    setups = draw_setups(plan, draw_routes(plan, episodes, rules), seed, clutter, rules)
    spec = scene_spec(plan.boxes, Boxes.empty())
    spec.modelname, spec.comment = plan.name, ""
    tasks = {
        "plan": plan.name,
        "obstacles": obstacles,
        "seed": seed,
        "time_limit": rules.time_limit,
        "episodes": [_describe_episode(setup) for setup in setups],
    }
    try:
        folder.mkdir(parents=True, exist_ok=True)
        (folder / HOME_FILE).write_text(spec.to_xml(), encoding="utf-8")
        (folder / EPISODES_FILE).write_text(json.dumps(tasks) + "\n", encoding="utf-8")
    except OSError as error:
        raise InputError(f"cannot write {folder}: {error.strerror}; choose another --out or make room") from None
    return folder


def _describe_episode(setup: EpisodeSetup) -> dict[str, Any]:
    return {
        "start": np.round(setup.route.start, 6).tolist(),
        "goal": np.round(setup.route.goal, 6).tolist(),
        "yaw": round(setup.yaw, 6),
        "joints": np.round(setup.joints, 6).tolist(),
        "shortest_m": round(setup.route.geodesic_m, 4),
        "blocks": np.round(setup.blocks.rows, 6).tolist(),
    }
