"""Episodes of a navigator in homes that it has never seen, in the kinematic environment: one episode a robot."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Float

from vinl.nav.config import NavConfig
from vinl.nav.environment import NavEnvironment
from vinl.nav.follower import PathFollower
from vinl.nav.home_store import HomeStore
from vinl.nav.measures import EpisodeEnd
from vinl.policies.depth_policy import DepthPolicy
from vinl.world.endings import END_REASONS as ALL_REASONS
from vinl.world.endings import FALL, LOOPING, STUCK, SUCCESS, TIMEOUT

END_REASONS = tuple(reason for reason in ALL_REASONS if reason != FALL)
"""How an episode ends; nothing falls here."""

_CHECK_EVERY = 25


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
        config: as ``evaluation_setup.describe_episodes`` returns it.
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


def _pick(chosen: torch.Tensor) -> Callable[[torch.Tensor, torch.Tensor], torch.Tensor]:
    return lambda now, before: torch.where(chosen, now, before)


def _reason(ended: dict[str, np.ndarray], k: int) -> str:
    if ended["success"][k]:
        return SUCCESS
    return STUCK if ended["stuck"][k] else LOOPING if ended["looping"][k] else TIMEOUT
