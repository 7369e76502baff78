"""Episodes of a navigator in homes that it has never seen, in the kinematic environment: one episode a robot."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import torch
from jaxtyping import Float

from vinl.config.errors import InputError
from vinl.config.loader import build_config, load_config
from vinl.nav.config import CameraConfig, EpisodeConfig, NavConfig
from vinl.nav.environment import NavEnvironment
from vinl.nav.follower import PathFollower
from vinl.nav.home_store import HomeStore
from vinl.nav.measures import EpisodeEnd
from vinl.policies.card import PolicyCard, find_previous
from vinl.policies.depth_policy import DepthPolicy
from vinl.policies.io import load_policy
from vinl.world.endings import END_REASONS as ALL_REASONS
from vinl.world.endings import FALL, LOOPING, STUCK, SUCCESS, TIMEOUT
from vinl.world.readers import expand_paths, shipped_floorplans

MOTIONS = {
    "walking": "nav/motion/walking",
    "level": "nav/motion/level",
    "steady": "nav/motion/steady",
    "paper": "nav/paper",
}
"""How camera and robot move, and the config that says it: as recorded from the walking robot on clutter or on level
ground, not at all, or redrawn at each step [paper]."""

ORACLE = "oracle"
END_REASONS = tuple(reason for reason in ALL_REASONS if reason != FALL)
"""How an episode ends; nothing falls here."""

_CHECK_EVERY = 25


@dataclass(frozen=True)
class NavEvaluation:
    """The rules.

    Attributes:
        episodes: of each kind of home.
        seed: of starts, goals, headings and the camera's motion.
        motion: a key of ``MOTIONS``.
        distance: range of the geodesic distance at the start [m].
        steps: an episode ends after so many decisions of 0.5 s [paper code: 250].
        goals: in each home.
        clutter: share of the homes with blocks that are seen but stop no robot.
        start_clearance: starts keep this distance from walls and furniture [m]; the rectangle turns on the spot with
            0.36 m, and starts lie up to 0.07 m off the cells' centres. In ``vinl eval`` it is 0.5 m [paper].
    """

    episodes: int = 1000
    seed: int = 0
    motion: str = "walking"
    distance: tuple[float, float] = (5.0, 30.0)
    steps: int = 250
    goals: int = 8
    clutter: float = 0.0
    start_clearance: float = 0.45

    def __post_init__(self) -> None:
        if not 1 <= self.episodes <= 65536:
            raise InputError(f"--episodes must lie between 1 and 65536, got {self.episodes}")
        if not 0 <= self.seed < 2**31:
            raise InputError(f"--seed must lie between 0 and 2147483647, got {self.seed}")
        if self.motion not in MOTIONS:
            raise InputError(f"--motion must be one of {', '.join(MOTIONS)}, got {self.motion!r}")
        if not 0 <= self.clutter <= 1:
            raise InputError(f"--clutter must lie between 0 and 1, got {self.clutter:g}")
        if self.steps < 1:
            raise InputError(f"--steps must be at least 1, got {self.steps}")


@dataclass(frozen=True)
class NavRecord:
    """One episode; names as in ``vinl eval``.

    Attributes:
        kind: of home: ``generated``, or what the floor plan's file is.
        plan: name of the home.
        episode: number within its kind.
        seed: of the evaluation.
        start, goal: x, y [m].
        yaw: heading at the start [rad].
        straight_m, geodesic_m: straight and shortest distance from start to goal [m].
        success: came within the success radius.
        end_reason: one of ``END_REASONS``.
        time_s: length [s].
        distance_m: way driven [m].
        spl, soft_spl: see ``EpisodeEnd``.
        collisions: steps that were cancelled because the robot would have touched something.
        left_m: shortest distance to the goal at the end [m].
    """

    kind: str
    plan: str
    episode: int
    seed: int
    start: tuple[float, float]
    goal: tuple[float, float]
    yaw: float
    straight_m: float
    geodesic_m: float
    success: bool
    end_reason: str
    time_s: float
    distance_m: float
    spl: float
    soft_spl: float
    collisions: int
    left_m: float


@dataclass(frozen=True, eq=False)
class NavTrace:
    """What a drawing needs: ``path`` (k, 2) [m], ``solid`` (n, 7) boxes of the home, ``blocks`` (m, 6)."""

    path: Float[np.ndarray, "k 2"]
    solid: Float[np.ndarray, "n 7"]
    blocks: Float[np.ndarray, "m 6"]


@dataclass(frozen=True, eq=False)
class KindResults:
    """All episodes in one kind of home.

    Attributes:
        kind: of home.
        homes: their names.
        dropped: homes that no episode could be made in.
        reasons: why not, of each.
        left_out: robots that no start within the range of distances was found for; they are in no figure.
        records, traces: one an episode.
    """

    kind: str
    homes: list[str]
    dropped: int
    reasons: list[str]
    left_out: int
    records: list[NavRecord]
    traces: list[NavTrace]


def load_navigator(name: str, device: str) -> DepthPolicy | None:
    """A trained navigator, or None for the oracle.

    Raises:
        InputError: there is no such policy, or it is no navigator.
    """
    if name == ORACLE:
        return None
    policy = load_policy(name, device)
    if not isinstance(policy, DepthPolicy) or policy.card.kind != "navigation":
        raise InputError(f"--policy {name}: a {policy.card.kind} policy; give a navigator, or oracle")
    return policy


def name_kind(path: str) -> str:
    """What kind of floor plan a path leads to, for the tables: the file's stem where it holds many."""
    if path in shipped_floorplans():
        return "shipped"
    file = re.sub(r":\d+$", "", path).lower()
    for kind, endings in (("ros_map", (".yaml", ".yml")), ("picture", (".png", ".pgm"))):
        if file.endswith(endings):
            return kind
    return Path(file).name.split(".")[0]


def describe_episodes(card: PolicyCard | None, rules: NavEvaluation) -> NavConfig:
    """The environment of an evaluation: the policy's camera and memory of its last step, the motion and execution of
    ``rules.motion``. The walking robot carries the camera as high as it walks, whatever the training took.

    Args:
        card: of the navigator; None: blind (the oracle).
        rules: of the evaluation.
    """
    config = load_config(NavConfig, MOTIONS[rules.motion])
    camera = None
    if card is not None and card.camera is not None:
        trained = card.training.get("camera") or {}
        known = {k: card.camera[k] for k in ("pitch_down", "hfov", "width", "height", "far")}
        assert config.camera is not None
        mount = {"mount_height": config.camera.mount_height}
        if rules.motion == "paper" and "mount_height" in trained:
            mount = {"mount_height": trained["mount_height"]}
        camera = build_config(CameraConfig, {**known, "forward": card.camera["position"][0], **mount}, source="card")
    episodes: EpisodeConfig = replace(
        config.episodes, distance=rules.distance, steps=rules.steps, start_speed=(0.0, 0.0)
    )
    homes = replace(
        config.homes,
        goals=rules.goals,
        starts=512,
        start_clearance=rules.start_clearance,
        fresh=0.0,
        plans=(),
        plans_share=0.0,
    )
    return replace(
        config,
        num_envs=rules.episodes,
        seed=rules.seed,
        previous="action" if card is None else find_previous(card),
        camera=camera,
        episodes=episodes,
        homes=homes,
        clutter=replace(config.clutter, share=rules.clutter),
    )


def build_homes(
    config: NavConfig,
    count: int,
    homes_seed: int,
    plans: Sequence[str],
    device: str,
    progress: Callable[[int, int], None] | None = None,
) -> dict[str, HomeStore]:
    """Homes by kind.

    Args:
        config: of the environment.
        count: generated homes; 0: none.
        homes_seed: of the first one; training starts from seed 1, so choose one far above its number of homes.
        plans: floor plans, see ``vinl.world.readers.expand_paths``.
        device: for the homes.
        progress: called with homes done and wanted, of each kind anew.

    Raises:
        InputError: there are no homes, or none of a kind can be used.
    """
    stores: dict[str, HomeStore] = {}
    if count:
        generated = replace(config, homes=replace(config.homes, count=count, seed=homes_seed))
        stores["generated"] = HomeStore.build(generated, device, progress)
    groups: dict[str, list[str]] = {}
    for path in expand_paths(plans):
        groups.setdefault(name_kind(path), []).append(path)
    for kind, paths in groups.items():
        own = replace(config, homes=replace(config.homes, seed=homes_seed))
        stores[kind] = HomeStore.from_paths(paths, own, device, progress=progress)
    if not stores:
        raise InputError("there are no homes: give --homes N or --floorplans FILE")
    return stores


def evaluate_kind(
    policy: DepthPolicy | None,
    kind: str,
    homes: HomeStore,
    config: NavConfig,
    progress: Callable[[int, int], None] | None = None,
) -> KindResults:
    """One episode for each robot; the same for every policy that is given the same homes and configuration.

    Args:
        policy: the navigator; None: the oracle.
        kind: name of the kind of homes.
        homes: to drive in.
        config: as ``describe_episodes`` returns it.
        progress: called with steps done and steps at most.
    """
    with torch.no_grad():
        environment = NavEnvironment(config, homes, homes.device)
        n, state = config.num_envs, environment.state
        begun = {k: state[k].clone() for k in ("home", "position", "yaw", "start_distance", "unplaced")}
        goals = environment.goals().clone()
        follower = PathFollower(environment) if policy is None else None
        if policy is not None:
            policy.reset(n)
        over = torch.zeros(n, dtype=torch.bool, device=environment.device)
        figures: EpisodeEnd | None = None
        paths = [begun["position"]]
        for step in range(config.episodes.steps):
            if follower is not None:
                action = follower.act()
            else:
                assert policy is not None
                depth, vector = environment.observe()
                metres = depth.float() * policy.camera.far if policy.camera is not None else None
                action = policy.act(vector, metres)
            environment.advance(action)
            end = environment.ended
            assert end is not None
            first = end.counted & ~over
            figures = end if figures is None else EpisodeEnd(*map(_pick(first), end, figures))
            over |= end.counted
            paths.append(torch.where((over & ~first)[:, None], paths[-1], state["position"]))
            environment.restart(end.counted)
            if progress is not None:
                progress(step + 1, config.episodes.steps)
            if step % _CHECK_EVERY == _CHECK_EVERY - 1 and bool(over.all()):
                break
        assert figures is not None
        trail = torch.stack(paths, 1).cpu().numpy().astype(np.float64)
        ended = {name: value.cpu().numpy() for name, value in figures._asdict().items()}
        began = {name: value.cpu().numpy() for name, value in begun.items()}
        ends = goals.cpu().numpy().astype(np.float64)
    results = KindResults(
        kind, [r.name for r in homes.records], homes.dropped, homes.reasons, int((began["unplaced"] > 0).sum()), [], []
    )
    for k in range(n):
        if began["unplaced"][k] > 0:
            continue
        home = homes.records[int(began["home"][k])]
        start, goal = trail[k, 0], ends[k]
        steps = round(float(ended["steps"][k]))
        results.records.append(
            NavRecord(
                kind=kind,
                plan=home.name,
                episode=k,
                seed=config.seed,
                start=(round(float(start[0]), 3), round(float(start[1]), 3)),
                goal=(round(float(goal[0]), 3), round(float(goal[1]), 3)),
                yaw=round(float(began["yaw"][k]), 4),
                straight_m=round(float(np.linalg.norm(goal - start)), 3),
                geodesic_m=round(float(began["start_distance"][k]), 3),
                success=bool(ended["success"][k]),
                end_reason=_reason(ended, k),
                time_s=steps * config.robot.period,
                distance_m=round(float(ended["path"][k]), 3),
                spl=round(float(ended["spl"][k]), 4),
                soft_spl=round(float(ended["soft_spl"][k]), 4),
                collisions=round(float(ended["collisions"][k])),
                left_m=round(float(ended["end_distance"][k]), 3),
            )
        )
        results.traces.append(NavTrace(trail[k, : steps + 1], home.solid.astype(float), home.blocks.astype(float)))
    return results


def describe_policy(policy: DepthPolicy | None) -> dict[str, Any]:
    """What the results say of a navigator."""
    if policy is None:
        return {"name": ORACLE}
    card = policy.card
    homes = card.training.get("homes", {})
    return {
        "name": card.name,
        "samples": card.samples,
        "commit": card.commit,
        "camera": card.camera,
        "trained_in": {k: homes[k] for k in ("count", "seed", "plans", "plans_share") if k in homes},
    }


def _pick(chosen: torch.Tensor) -> Callable[[torch.Tensor, torch.Tensor], torch.Tensor]:
    return lambda now, before: torch.where(chosen, now, before)


def _reason(ended: dict[str, np.ndarray], k: int) -> str:
    if ended["success"][k]:
        return SUCCESS
    return STUCK if ended["stuck"][k] else LOOPING if ended["looping"][k] else TIMEOUT
