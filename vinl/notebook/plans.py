"""Floor plans, their clutter and ways through them: drawn by a seed, shown as pictures."""

from __future__ import annotations

import io
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from jaxtyping import Float
from PIL import Image

from vinl.world.boxes import Blocks
from vinl.world.clutter import ClutterPreset, choose_clutter, scatter_blocks
from vinl.world.drawing import encode_floorplan
from vinl.world.floorplan import FloorPlan
from vinl.world.readers import load_floorplan
from vinl.world.start_goal import StartGoal, sample_start_goals


def open_plan(plan: str | Path | FloorPlan) -> FloorPlan:
    """The plan itself, or the one of that name or file."""
    return plan if isinstance(plan, FloorPlan) else load_floorplan(plan)


def sample_routes(
    plan: str | Path | FloorPlan, count: int = 1, seed: int = 0, min_distance: float = 5.0
) -> list[StartGoal]:
    """Pairs of start and goal, at least so far apart [m] where the plan is large enough.

    Raises:
        InputError: the plan has no room for the robot.
    """
    return sample_start_goals(open_plan(plan), count, np.random.default_rng(seed), min_distance)


def scatter_clutter(
    plan: str | Path | FloorPlan,
    preset: str | ClutterPreset = "paper",
    seed: int = 0,
    routes: Sequence[StartGoal] = (),
) -> Blocks:
    """Blocks on the free floor of a plan.

    Args:
        plan: the floor plan.
        preset: ``"none"``, ``"paper"``, ``"dense"``, or how many, how large and how far apart.
        seed: of the draw.
        routes: their starts and goals are kept clear, as in an episode.

    Raises:
        InputError: there is no preset of that name.
    """
    if isinstance(preset, str):
        preset = choose_clutter(preset, "clutter")
    clear = np.array([point for route in routes for point in (route.start, route.goal)]).reshape(-1, 2)
    return scatter_blocks(open_plan(plan), preset, np.random.default_rng(seed), clear)


def draw_plan(
    plan: str | Path | FloorPlan,
    blocks: Blocks | None = None,
    routes: Sequence[StartGoal] = (),
    paths: Sequence[Float[np.ndarray, "k 2"]] = (),
    title: str | None = None,
) -> Image.Image:
    """A plan from above, with its clutter, a dot with its heading for each start, a ring for each goal, and paths,
    lines of points [m] such as ``walk.trace.path``; ``title`` is name and free area by default, "" leaves it away."""
    drawn = {"blocks": blocks, "start_goals": routes, "paths": paths, "title": title}
    return Image.open(io.BytesIO(encode_floorplan(open_plan(plan), **drawn))).convert("RGB")
