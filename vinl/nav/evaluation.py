"""Episodes of a navigator in homes that it has never seen, in the kinematic environment: one episode a robot."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Float
from torch import Tensor

from vinl.chain.metrics import soft_spl, spl
from vinl.chain.navigators.base import Task
from vinl.chain.navigators.oracle import OracleNavigator
from vinl.chain.records import RouteRecord
from vinl.nav.config import NavConfig
from vinl.nav.environment import NavEnvironment
from vinl.nav.home_store import HomeStore
from vinl.nav.measures import EpisodeEnd
from vinl.policies.depth_policy import DepthPolicy
from vinl.policies.velocity_range import VelocityRange
from vinl.world.endings import END_REASONS as ALL_REASONS
from vinl.world.endings import FALL, SUCCESS, name_late_end
from vinl.world.free_space import FreeSpace
from vinl.world.start_goal import measure_route, shortest_distance

END_REASONS = tuple(reason for reason in ALL_REASONS if reason != FALL)
"""How an episode ends; nothing falls here."""

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
        kind: of home.
        homes: their names.
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
        kind: name of the kind of homes.
        homes: to drive in.
        config: as ``evaluation_setup.describe_episodes`` returns it.
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
    policy.reset(environment.num_envs)

    def act(over: Tensor) -> Tensor:
        depth, vector = environment.observe()
        return policy.act(vector, depth.float() * policy.camera.far if policy.camera is not None else None)

    return act


def _open_oracle(tasks: list[Task], kept: list[int], environment: NavEnvironment) -> Callable[[Tensor], Tensor]:
    """The path follower of ``vinl eval`` for the robots that have a path; the others stay where they are."""
    robot = environment.config.robot
    span = VelocityRange((robot.min_speed, robot.max_speed), (-robot.max_yaw_rate, robot.max_yaw_rate))
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


def _pick(chosen: torch.Tensor) -> Callable[[torch.Tensor, torch.Tensor], torch.Tensor]:
    return lambda now, before: torch.where(chosen, now, before)
