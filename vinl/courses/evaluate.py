"""The locomotor alone in MuJoCo C, under random commands: one policy, or several on the same courses."""

from __future__ import annotations

import itertools
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from functools import lru_cache
from typing import Any, Generic, TypeVar

import numpy as np

from vinl.chain.choose import check_locomotion_policy
from vinl.chain.workers import Context, WorkerPool
from vinl.config.limits import check_number
from vinl.courses.block_contacts import BINS, bin_heights
from vinl.courses.courses import CommandRanges, Course, choose_commands, command_ranges
from vinl.courses.grounds import DENSITY, Ground, GroundConfig, build_ground
from vinl.courses.robot_records import RobotRecord, aggregate_robots
from vinl.courses.trial import BoxHerd, run_trial
from vinl.policies.identity import describe_policy
from vinl.policies.policy import Policy
from vinl.robot.aliengo import CONTROL_DT

Record = TypeVar("Record")
Part = TypeVar("Part")

GROUP = 16
"""Robots in one unit of work. Fixed, so that results do not depend on the number of workers."""


@dataclass(frozen=True, eq=False)
class TrialResults(Generic[Record]):
    """Records of one policy's robots in the order of their numbers, or crossings by height as asked for, then by
    number; the figures of all; the digest of the policy's card; everything that the run depends on; and how long it
    took [s]."""

    records: list[Record]
    aggregate: dict[str, Any]
    policies: dict[str, Any]
    config: dict[str, Any]
    wall_seconds: float


@dataclass(frozen=True)
class Group:
    """A unit of work: robots or crossings of one policy, by their numbers."""

    policy: int
    numbers: range


def run_groups(
    work: Callable[[Context, Any], list[Part]],
    shared: Any,
    groups: Sequence[Group],
    workers: int,
    on_piece: Callable[[int], None],
) -> tuple[list[list[Part]], float]:
    """Work through all groups in worker processes. ``work`` gets each group, reports one piece for each of its numbers,
    and returns what came of them; ``on_piece`` gets how many numbers are done. The numbers of each policy ascend from
    group to group.

    Returns what came of the numbers, by policy, and how long it took [s].
    """
    began, done = time.perf_counter(), itertools.count(1)
    with WorkerPool(min(workers, len(groups)), shared) as pool:
        parts = pool.run(work, list(groups), lambda: on_piece(next(done)))
    by_policy: list[list[Part]] = [[] for _ in {group.policy for group in groups}]
    for group, part in zip(groups, parts, strict=True):
        by_policy[group.policy] += part
    return by_policy, time.perf_counter() - began


def cut_groups(count: int) -> list[range]:
    """The numbers of robots or crossings that walk side by side."""
    return [range(first, min(first + GROUP, count)) for first in range(0, count, GROUP)]


@dataclass(frozen=True)
class _Shared:
    policies: list[Policy]
    grounds: list[GroundConfig]
    ranges: CommandRanges
    steps: int


def compare_locomotors(
    policies: Sequence[Policy],
    terrain: str = "flat",
    robots: int = 64,
    seconds: float = 20.0,
    seed: int = 0,
    density: float | None = None,
    level: int | None = None,
    commands: str | None = None,
    workers: int = 1,
    on_progress: Callable[[str, int, int], None] = lambda *_: None,
) -> list[TrialResults[RobotRecord]]:
    """Let robots follow random commands for a time [s]; a robot that falls starts afresh. Every policy meets the same
    courses.

    Terrains are ``grounds.TERRAINS``, with ``density`` blocks or objects per m2 (None: ``grounds.DENSITY``) and, of
    ``rough``, a level for all robots (None: 1 to 9 by turns); commands are one of ``courses.COMMANDS`` (None:
    ``courses.DEFAULTS``). Results do not depend on the number of workers. ``on_progress`` is called with ``"robot"``,
    robots done and robots in all. Raises ``InputError`` if a number is out of range or a name unknown.
    """
    check_number("--robots", robots, 1, 100_000)
    check_number("--seconds", seconds, CONTROL_DT, 36_000)
    check_number("--seed", seed, 0, 2**31 - 1)
    check_number("--workers", workers, 1, 1024)
    chosen = choose_commands(commands, terrain)
    density = DENSITY.get(terrain, 1.0) if density is None else density
    for policy in policies:
        check_locomotion_policy(policy)
    grounds = [
        GroundConfig(terrain, density, level, seed, float(p.card.action["kp"]), float(p.card.action["kd"]))
        for p in policies
    ]
    ranges = command_ranges(chosen, policies)
    jobs = [Group(p, numbers) for p in range(len(policies)) for numbers in cut_groups(robots)]
    shared, total = _Shared(list(policies), grounds, ranges, round(seconds / CONTROL_DT)), robots * len(policies)
    parts, wall = run_groups(_run_group, shared, jobs, workers, lambda done: on_progress("robot", done, total))
    results = []
    for p, (policy, records) in enumerate(zip(policies, parts, strict=True)):
        config = {
            "ground": asdict(grounds[p]),
            "commands": {"name": chosen, **asdict(ranges)},
            "robots": robots,
            "seconds": seconds,
            "seed": seed,
        }
        ground = _ground(grounds[p])
        figures = aggregate_robots(records, height_fractions(ground), ground.covered())
        results.append(TrialResults(records, figures, {"locomotion": describe_policy(policy)}, config, wall))
    return results


def height_fractions(ground: Ground) -> np.ndarray | None:
    """(bins,) fraction of the blocks in every bin of height; None without blocks, and for litter, which is lower."""
    if not len(ground.blocks) or ground.among:
        return None
    return np.bincount(bin_heights(ground.blocks.rows[:, 5]), minlength=BINS) / len(ground.blocks)


_ground = lru_cache(maxsize=2)(build_ground)


def _run_group(context: Context, job: Group) -> list[RobotRecord]:
    """Some of the robots of one policy, in lockstep."""
    shared: _Shared = context.shared
    config = shared.grounds[job.policy]
    ground = _ground(config)
    courses = [Course(ground, shared.ranges, config.seed, k, shared.steps) for k in job.numbers]
    herd = BoxHerd(ground.model, len(courses))
    records = run_trial(herd, ground, courses, shared.policies[job.policy], context.is_stopped)
    for _ in courses:
        context.report()
    return records
