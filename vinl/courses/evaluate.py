"""The locomotor alone in MuJoCo C, under random commands: one policy, or several on the same courses."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from vinl.chain.choose import check_locomotion_policy
from vinl.chain.workers import Context, WorkerPool
from vinl.config.errors import InputError
from vinl.courses.block_contacts import BINS, bin_heights
from vinl.courses.courses import CommandRanges, Course, choose_commands, command_ranges
from vinl.courses.grounds import DENSITY, Ground, GroundConfig, build_ground
from vinl.courses.herd import BoxHerd
from vinl.courses.robot_records import RobotRecord, aggregate_robots
from vinl.courses.trial import run_trial
from vinl.policies.identity import describe_policy
from vinl.policies.policy import Policy
from vinl.robot.aliengo import CONTROL_DT

GROUP = 16
"""Robots in one unit of work. Fixed, so that results do not depend on the number of workers."""


@dataclass(frozen=True, eq=False)
class LocomotorResults:
    """Records of the robots, the figures, and what they depend on."""

    robots: list[RobotRecord]
    aggregate: dict[str, Any]
    policies: dict[str, Any]
    config: dict[str, Any]
    wall_seconds: float


@dataclass(frozen=True)
class _Shared:
    policies: list[Policy]
    grounds: list[GroundConfig]
    ranges: CommandRanges
    steps: int


@dataclass(frozen=True)
class _Job:
    policy: int
    robots: range


def evaluate_locomotor(
    policy: Policy,
    terrain: str = "flat",
    robots: int = 64,
    seconds: float = 20.0,
    seed: int = 0,
    density: float | None = None,
    level: int | None = None,
    commands: str | None = None,
    workers: int = 1,
    on_progress: Callable[[str, int, int], None] = lambda *_: None,
) -> LocomotorResults:
    """One policy; see ``compare_locomotors``."""
    return compare_locomotors([policy], terrain, robots, seconds, seed, density, level, commands, workers, on_progress)[
        0
    ]


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
) -> list[LocomotorResults]:
    """Let robots follow random commands; a robot that falls starts afresh. Every policy meets the same courses.

    Args:
        policies: the locomotors.
        terrain: one of ``grounds.TERRAINS``.
        robots: how many for each policy.
        seconds: how long [s].
        seed: of terrain, starts and commands.
        density: blocks or objects per m2; that of ``grounds.DENSITY`` if None.
        level: level of all robots, for ``rough``; 1 to 9 by turns if None.
        commands: one of ``courses.COMMANDS``; None: those of ``courses.DEFAULTS``.
        workers: processes; results do not depend on it.
        on_progress: called with ``"robot"``, robots done and robots in all.

    Raises:
        InputError: a number is out of range or a name unknown.
    """
    check_locomotor_numbers(robots, seconds, seed, workers)
    chosen, density = choose_commands(commands, terrain), choose_density(density, terrain)
    for policy in policies:
        check_locomotion_policy(policy)
    grounds = [
        GroundConfig(terrain, density, level, seed, float(p.card.action["kp"]), float(p.card.action["kd"]))
        for p in policies
    ]
    ranges, began, done = command_ranges(chosen, policies), time.perf_counter(), 0

    def count() -> None:
        nonlocal done
        done += 1
        on_progress("robot", done, robots * len(policies))

    groups = [range(first, min(first + GROUP, robots)) for first in range(0, robots, GROUP)]
    jobs = [_Job(p, group) for p in range(len(policies)) for group in groups]
    shared = _Shared(list(policies), grounds, ranges, round(seconds / CONTROL_DT))
    with WorkerPool(min(workers, len(jobs)), shared) as pool:
        parts = pool.run(_run_group, jobs, count)
    wall, results = time.perf_counter() - began, []
    for p, policy in enumerate(policies):
        records = [r for job, part in zip(jobs, parts, strict=True) if job.policy == p for r in part]
        config = {
            "ground": asdict(grounds[p]),
            "commands": {"name": chosen, **asdict(ranges)},
            "robots": robots,
            "seconds": seconds,
            "seed": seed,
        }
        ground = _ground(grounds[p])
        figures = aggregate_robots(records, height_fractions(ground), ground.covered())
        results.append(LocomotorResults(records, figures, {"locomotion": describe_policy(policy)}, config, wall))
    return results


def check_locomotor_numbers(robots: int, seconds: float, seed: int, workers: int) -> None:
    """Refuse numbers that make no sense.

    Raises:
        InputError: one of them is out of range.
    """
    for name, value, low, high in (
        ("robots", robots, 1, 100_000),
        ("seconds", seconds, CONTROL_DT, 36_000),
        ("seed", seed, 0, 2**31 - 1),
        ("workers", workers, 1, 1024),
    ):
        if not low <= value <= high:
            raise InputError(f"--{name} must lie between {low:g} and {high:g}, got {value:g}")


def choose_density(density: float | None, terrain: str) -> float:
    """Blocks or objects per m2: what is asked for, or what is usual on the terrain."""
    return DENSITY.get(terrain, 1.0) if density is None else density


def height_fractions(ground: Ground) -> np.ndarray | None:
    """(bins,) fraction of the blocks in every bin of height; None without blocks, and for litter, which is lower."""
    if not len(ground.blocks) or ground.among:
        return None
    return np.bincount(bin_heights(ground.blocks.rows[:, 5]), minlength=BINS) / len(ground.blocks)


@lru_cache(maxsize=2)
def _ground(config: GroundConfig) -> Ground:
    return build_ground(config)


def _run_group(context: Context, job: _Job) -> list[RobotRecord]:
    """Some of the robots of one policy, in lockstep."""
    shared: _Shared = context.shared
    config = shared.grounds[job.policy]
    ground = _ground(config)
    courses = [Course(ground, shared.ranges, config.seed, k, shared.steps) for k in job.robots]
    herd = BoxHerd(ground.model, len(courses))
    records = run_trial(herd, ground, courses, shared.policies[job.policy], context.is_stopped)
    for _ in courses:
        context.report()
    return records
