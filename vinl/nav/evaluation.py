"""Episodes of a navigator in homes that it has never seen, in the kinematic environment, one a robot: the rules, the
homes, the records."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import torch
from jaxtyping import Float
from torch import Tensor

from vinl.chain.batching import BatchedPolicy
from vinl.chain.metrics import soft_spl, spl
from vinl.chain.navigators.base import ORACLE, Task
from vinl.chain.navigators.oracle import OracleNavigator
from vinl.chain.records import RouteRecord
from vinl.config.errors import InputError
from vinl.config.limits import check_fields, check_limits
from vinl.config.loader import build_config, load_config
from vinl.nav.config import EpisodeConfig, NavCameraConfig, NavConfig, RobotConfig
from vinl.nav.environment import EpisodeEnd, NavEnvironment
from vinl.nav.home_store import HomeStore
from vinl.policies.card import PolicyCard, find_previous
from vinl.policies.depth_policy import DepthPolicy
from vinl.policies.io import load_policy
from vinl.policies.velocity_range import VelocityRange
from vinl.sensing.sensor_config import OdometryConfig, load_sensors
from vinl.world.endings import SUCCESS, name_late_end
from vinl.world.free_space import FreeSpace
from vinl.world.homes.generate import find_judging_set
from vinl.world.readers import expand_paths, shipped_floorplans
from vinl.world.start_goal import measure_route, shortest_distance

_CHECK_EVERY = 25


@dataclass(frozen=True)
class NavRecord(RouteRecord):
    """One episode of the kinematic environment; nothing falls.

    Attributes:
        kind: of home: ``generated``, or what the floor plan's file is.
        collisions: steps that were cancelled because the robot would have touched something.
        left_m: shortest distance to the goal at the end [m], by the environment.
    """

    kind: str
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
        dropped: homes that no episode could be made in.
        reasons: why not, of each.
        left_out: robots that no start within the range of distances was found for, or no path; they are in no figure.
        records, traces: one an episode.
    """

    kind: str
    homes: list[str]
    dropped: int
    reasons: list[str]
    left_out: int
    records: list[NavRecord]
    traces: list[NavTrace]


def evaluate_kind(
    policy: DepthPolicy | None,
    kind: str,
    homes: HomeStore,
    config: NavConfig,
    progress: Callable[[int, int], None] | None = None,
) -> KindResults:
    """One episode for each robot; the same for every policy that is given the same homes and configuration.

    Shortest distances are those of ``vinl eval``, on the floor plan's own grid; the ranges of ``config.episodes`` hold
    for the coarser ones of the environment.

    Args:
        policy: the navigator; None: the oracle.
        config: as ``evaluation.describe_episodes`` returns it.
        progress: called with steps done and steps at most.
    """
    with torch.no_grad():
        environment = NavEnvironment(config, homes, homes.device)
        state = environment.state
        begun = {k: state[k].clone().cpu().numpy() for k in ("home", "position", "yaw", "unplaced")}
        tasks = _measure_routes(environment)
        kept = [k for k, task in enumerate(tasks) if np.isfinite(task.route.geodesic_m) and not begun["unplaced"][k]]
        act = _open_policy(policy, environment) if policy is not None else _open_oracle(tasks, kept, environment)
        over = torch.zeros(config.num_envs, dtype=torch.bool, device=environment.device)
        figures: EpisodeEnd | None = None
        paths = [state["position"].clone()]
        for step in range(config.episodes.steps):
            environment.advance(act(over))
            end = environment.ended
            assert end is not None
            first = end.counted & ~over
            figures = (
                end
                if figures is None
                else EpisodeEnd(*(torch.where(first, now, then) for now, then in zip(end, figures, strict=True)))
            )
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
    names, left_out = [r.name for r in homes.records], config.num_envs - len(kept)
    results = KindResults(kind, names, len(homes.reasons), homes.reasons, left_out, [], [])
    for k in kept:
        home, task, yaw = homes.records[int(begun["home"][k])], tasks[k], float(begun["yaw"][k])
        steps = round(float(ended["steps"][k]))
        path = trail[k, : steps + 1]
        results.records.append(
            _record(kind, config, k, task, yaw, path[-1], {n: v[k].item() for n, v in ended.items()})
        )
        results.traces.append(NavTrace(path, home.solid.astype(float), home.blocks.astype(float)))
    return results


def _measure_routes(environment: NavEnvironment) -> list[Task]:
    """Start and goal of every robot, with the distances that ``vinl eval`` would have; infinite where it finds no
    path."""
    records, state = environment.homes.records, environment.state
    spaces = [FreeSpace(record.restore_plan()) for record in records]
    starts, goals = (part.cpu().numpy().astype(np.float64) for part in (state["position"], environment.goals()))
    return [
        Task(spaces[home], measure_route(spaces[home], start, goal))
        for home, start, goal in zip(state["home"].tolist(), starts, goals, strict=True)
    ]


def _open_policy(policy: DepthPolicy, environment: NavEnvironment) -> Callable[[Tensor], Tensor]:
    """Only robots whose first episode goes on are asked for: most are at their goals after a fifth of the time."""
    n, camera = environment.num_envs, environment.camera
    asked, vectors = BatchedPolicy(policy), np.zeros((n, policy.network.observation_size), np.float32)
    asked.reset(n)
    images = torch.zeros(n, *((camera.height, camera.width) if camera else (0, 0)), device=environment.device)

    def act(over: Tensor) -> Tensor:
        rows = torch.nonzero(~over)[:, 0].int()
        depth, vector = environment.observe(rows)
        asked.rows = rows.tolist()
        vectors[asked.rows] = vector.cpu().numpy()
        if camera is not None:
            images[rows] = depth.float() * camera.far
        action = asked.act(vectors, images)
        return torch.as_tensor(action, device=environment.device)

    return act


def _open_oracle(tasks: list[Task], kept: list[int], environment: NavEnvironment) -> Callable[[Tensor], Tensor]:
    """The path follower of ``vinl eval`` for the robots that have a path; the others stay where they are."""
    span = environment.config.robot.velocity_range
    oracle, pose = OracleNavigator(), np.zeros((len(kept), 3))
    oracle.reset([tasks[k] for k in kept])

    def act(over: Tensor) -> Tensor:
        here = torch.cat([environment.state["position"], environment.state["yaw"][:, None]], 1).cpu().numpy()[kept]
        goes_on = ~over.cpu().numpy()[kept]
        pose[goes_on] = here[goes_on]  # whose episode has ended is elsewhere by now
        action = torch.zeros(environment.num_envs, 2)
        action[kept] = torch.as_tensor(span.action(oracle.act({"pose": pose})))
        return action.to(environment.device)

    return act


def _record(
    kind: str, config: NavConfig, k: int, task: Task, yaw: float, at: np.ndarray, ended: dict[str, float]
) -> NavRecord:
    """The record of robot k, which ended ``at`` a place, with the environment's figures of its episode."""
    route, success, moved = task.route, bool(ended["success"]), ended["path"]
    left = 0.0 if success else shortest_distance(task.space, at, route.goal)
    return NavRecord(
        kind=kind,
        plan=task.space.plan.name,
        episode=k,
        seed=config.seed,
        start=(round(float(route.start[0]), 3), round(float(route.start[1]), 3)),
        goal=(round(float(route.goal[0]), 3), round(float(route.goal[1]), 3)),
        yaw=round(yaw, 4),
        straight_m=round(route.straight_m, 3),
        geodesic_m=round(route.geodesic_m, 3),
        success=success,
        end_reason=SUCCESS if success else name_late_end(bool(ended["stuck"]), moved, route.geodesic_m),
        time_s=round(ended["steps"]) * config.robot.period,
        distance_m=round(moved, 3),
        spl=round(spl(success, route.geodesic_m, moved), 4),
        soft_spl=round(soft_spl(route.geodesic_m, left, moved), 4),
        collisions=round(ended["collisions"]),
        left_m=round(ended["end_distance"], 3),
    )


MOTIONS = {
    "walking": "nav/motion/walking",
    "cancelled": "nav/motion/cancelled",
    "level": "nav/motion/level",
    "steady": "nav/motion/steady",
    "paper": "nav/paper",
}
"""How camera and robot move, and the config that says it: as recorded from the walking robot on clutter, the same with
every step that touches cancelled as a whole, as recorded on level ground, not at all, or redrawn at each step [paper].
"""


@dataclass(frozen=True)
class NavEvaluation:
    """The rules.

    Attributes:
        episodes: of each kind of home.
        seed: of starts, goals, headings and the camera's motion.
        motion: a key of ``MOTIONS``.
        sensors: errors of the camera: ``ideal``, ``realistic``, ``training``, or a YAML file, see ``load_sensors``.
        drift: relative error of the distances that the robot measures on its way, see ``OdometryConfig``.
        distance: range of the geodesic distance at the start [m].
        steps: an episode ends after so many decisions of 0.5 s [paper code: 250].
        goals: in each home.
        clutter: fraction of the homes with blocks that are seen but stop no robot.
        start_clearance: starts keep this distance from walls and furniture [m]; the rectangle turns on the spot with
            0.36 m, and starts lie up to 0.07 m off the cells' centres. In ``vinl eval`` it is 0.5 m [paper].
    """

    episodes: int = 1000
    seed: int = 0
    motion: str = "walking"
    sensors: str = "ideal"
    drift: float = 0.0
    distance: tuple[float, float] = (5.0, 30.0)
    steps: int = 250
    goals: int = 8
    clutter: float = 0.0
    start_clearance: float = 0.45

    def __post_init__(self) -> None:
        check_limits(self, "--", episodes=(1, 65536), seed=(0, 2**31 - 1), drift=(0.0, 0.5))
        if self.motion not in MOTIONS:
            raise InputError(f"--motion must be one of {', '.join(MOTIONS)}, got {self.motion!r}")
        check_fields(self, "--", counts=("steps",), fractions=("clutter",))


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
    """The environment of an evaluation: the policy's camera, velocities and memory of its last step, the motion and
    execution of ``rules.motion``. The walking robot carries the camera as high as it walks, whatever the training took.

    Args:
        card: of the navigator; None: blind (the oracle).

    Raises:
        InputError: the card's velocities are none that the environment knows.
    """
    config = load_config(NavConfig, MOTIONS[rules.motion])
    camera = None
    if card is not None and card.camera is not None:
        trained = card.training.get("camera") or {}
        known = {k: card.camera[k] for k in ("pitch_down", "hfov", "width", "height", "far")}
        known["missing"] = card.camera.get("missing", "as_is")
        assert config.camera is not None
        mount = {"mount_height": config.camera.mount_height}
        if rules.motion == "paper" and "mount_height" in trained:
            mount = {"mount_height": trained["mount_height"]}
        camera = build_config(NavCameraConfig, {**known, "forward": card.camera["position"][0], **mount}, source="card")
    episodes: EpisodeConfig = replace(
        config.episodes, distance=rules.distance, steps=rules.steps, start_speed=(0.0, 0.0)
    )
    homes = replace(
        config.homes,
        goals=rules.goals,
        starts=512,
        layouts={},
        start_clearance=rules.start_clearance,
        plans=(),
        plans_share=0.0,
    )
    robot = replace(RobotConfig(), max_speed=config.robot.max_speed)  # as wide as it is, whatever was trained with
    if card is not None:
        span = VelocityRange.of(card)
        if span.forward_speed[0] > 0 or span.yaw_rate[0] != -span.yaw_rate[1]:
            raise InputError(
                f"{card.name}: its card has forward_speed {list(span.forward_speed)}, yaw_rate {list(span.yaw_rate)}; "
                "in the kinematic environment a robot can stand still and turns to both sides alike"
            )
        low, high = span.forward_speed
        robot = replace(robot, min_speed=low, max_speed=high, max_yaw_rate=span.yaw_rate[1])
    return replace(
        config,
        robot=robot,
        num_envs=rules.episodes,
        seed=rules.seed,
        previous="action" if card is None else find_previous(card),
        camera=camera,
        sensors=load_sensors(rules.sensors),
        odometry=OdometryConfig((rules.drift, rules.drift)),
        episodes=episodes,
        homes=homes,
        clutter=replace(config.clutter, share=rules.clutter),
        network=replace(config.network, grid=False),  # the policy brings its own
    )


def build_homes(
    config: NavConfig,
    count: int,
    homes_seed: int,
    plans: Sequence[str],
    device: str,
    progress: Callable[[int, int], None] | None = None,
    sets: Sequence[str] = (),
) -> dict[str, HomeStore]:
    """Homes by kind.

    Args:
        count: generated homes; 0: none.
        homes_seed: of the first one; training starts from seed 1, so choose one far above its number of homes.
        plans: floor plans, see ``vinl.world.readers.expand_paths``.
        progress: called with homes done and wanted, of each kind anew.
        sets: names of ``vinl.world.homes.generate.JUDGING_SETS``.

    Raises:
        InputError: there are no homes, or none of a kind can be used.
    """
    stores: dict[str, HomeStore] = {}
    if count:
        generated = replace(config, homes=replace(config.homes, count=count, seed=homes_seed))
        stores["generated"] = HomeStore.build(generated, device, progress)
    for name, judged in {name: find_judging_set(name) for name in sets}.items():
        own = replace(config, homes=replace(config.homes, seed=judged.first_seed))
        stores[name] = HomeStore.from_plans(judged.generate(), own, device)
    groups: dict[str, list[str]] = {}
    for path in expand_paths(plans):
        groups.setdefault(name_kind(path), []).append(path)
    for kind, paths in groups.items():
        own = replace(config, homes=replace(config.homes, seed=homes_seed))
        stores[kind] = HomeStore.from_paths(paths, own, device, progress=progress)
    if not stores:
        raise InputError("there are no homes: give --homes N, --sets NAME or --floorplans FILE")
    return stores


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
