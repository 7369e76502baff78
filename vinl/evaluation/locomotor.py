"""The locomotor alone in MuJoCo C, under random commands."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from functools import lru_cache
from typing import Any

import numpy as np
from jaxtyping import Float

from vinl.config.errors import InputError
from vinl.evaluation.crew import Context, Crew
from vinl.evaluation.evaluate import check_senses, describe_policy
from vinl.evaluation.grounds import Ground, GroundConfig, build_ground
from vinl.evaluation.walker import Walker, joint_targets
from vinl.policies.policy import Policy
from vinl.robot.aliengo import CONTROL_DT, DEFAULT_POSE
from vinl.robot.observation import observe
from vinl.robot.rotation import rotate_inverse
from vinl.sensing.height_scan import scan_ground

GROUP = 16
"""Robots in one unit of work. Fixed, so that results do not depend on the number of workers."""

HOLD = (5.0, 10.0)
"""A command is held so long [s]."""

SETTLED = 50
"""Control steps after a new command that the ``settled`` errors leave out."""

MAX_TILT = 1.2566
"""A trunk tilted farther than this has fallen [rad]: 72 deg."""

_COMMAND_LIMIT = 1.0


@dataclass(frozen=True)
class CommandRanges:
    """Ranges of the random commands [m/s, m/s, rad/s]; slower linear commands than ``min_speed`` [m/s] become zero."""

    forward: tuple[float, float] = (-1.0, 1.0)
    left: tuple[float, float] = (-1.0, 1.0)
    yaw_rate: tuple[float, float] = (-1.0, 1.0)
    min_speed: float = 0.2


@dataclass
class RobotRecord:
    """One robot's tally, as it stands in ``results.json``. ``*_steps`` count control steps of 0.02 s."""

    robot: int
    kind: str
    level: int | None
    falls: int = 0
    metres: float = 0.0
    steps: int = 0
    settled_steps: int = 0
    foot_block_steps: int = 0
    leg_block_steps: int = 0
    errors: list[float] = field(default_factory=lambda: [0.0] * 4)
    """Sums of squared errors: linear, yaw rate; the same without the first second after a new command."""


@dataclass(frozen=True, eq=False)
class LocomotorResults:
    """Records of the robots, the figures, and what they depend on."""

    robots: list[RobotRecord]
    aggregate: dict[str, Any]
    policies: dict[str, Any]
    config: dict[str, Any]
    wall_seconds: float


def command_ranges(policy: Policy, forward_only: bool = False) -> CommandRanges:
    """What the policy was trained for, at most +-1 m/s and +-1 rad/s; ``forward_only`` leaves sideways ones out."""
    trained = policy.card.training.get("commands", {})

    def cut(name: str) -> tuple[float, float]:
        low, high = trained.get(name, (-_COMMAND_LIMIT, _COMMAND_LIMIT))
        return max(float(low), -_COMMAND_LIMIT), min(float(high), _COMMAND_LIMIT)

    left = (0.0, 0.0) if forward_only else cut("left")
    return CommandRanges(cut("forward"), left, cut("yaw_rate"), float(trained.get("min_speed", 0.2)))


def evaluate_locomotor(
    policy: Policy,
    terrain: str = "flat",
    robots: int = 64,
    seconds: float = 20.0,
    seed: int = 0,
    density: float = 1.0,
    level: int | None = None,
    forward_only: bool = False,
    workers: int = 1,
    on_progress: Callable[[str, int, int], None] = lambda *_: None,
) -> LocomotorResults:
    """Let robots follow random commands; a robot that falls starts afresh.

    Args:
        policy: the locomotor.
        terrain: ``flat``, ``rough`` or ``blocks``.
        robots: how many.
        seconds: how long [s].
        seed: of terrain, starts and commands.
        density: blocks per m2, for ``blocks``.
        level: level of all robots, for ``rough``; 1 to 9 by turns if None.
        forward_only: no sideways velocities: forward, back and turning, as a navigator commands.
        workers: processes; results do not depend on it.
        on_progress: called with ``"robot"``, robots done and robots in all.

    Raises:
        InputError: a number is out of range.
    """
    check_locomotor_numbers(robots, seconds, seed, workers)
    check_senses(policy)
    action = policy.card.action
    ground = GroundConfig(terrain, density, level, seed, float(action["kp"]), float(action["kd"]))
    ranges, began, done = command_ranges(policy, forward_only), time.perf_counter(), 0

    def count() -> None:
        nonlocal done
        done += 1
        on_progress("robot", done, robots)

    jobs = [range(first, min(first + GROUP, robots)) for first in range(0, robots, GROUP)]
    with Crew(min(workers, len(jobs)), (policy, ground, ranges, round(seconds / CONTROL_DT))) as crew:
        records = [record for group in crew.run(_run_group, jobs, count) for record in group]
    config = {"ground": asdict(ground), "commands": asdict(ranges), "robots": robots, "seconds": seconds, "seed": seed}
    wall = time.perf_counter() - began
    policies = {"locomotion": describe_policy(policy)}
    return LocomotorResults(records, aggregate_robots(records), policies, config, wall)


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


def aggregate_robots(records: list[RobotRecord]) -> dict[str, Any]:
    """The figures of all robots. ``falls`` is the share of robots that fell at least once."""
    metres, steps = sum(r.metres for r in records), max(sum(r.steps for r in records), 1)
    settled = sum(r.settled_steps for r in records)
    sums = np.sum([r.errors for r in records], axis=0)
    fallen, levels = sum(r.falls > 0 for r in records), [r.level for r in records if r.level is not None]
    figures: dict[str, Any] = {
        "falls": fallen / len(records),
        "fall_count": sum(r.falls for r in records),
        "falls_per_minute": sum(r.falls for r in records) / (steps * CONTROL_DT / 60),
        "linear_velocity_rmse": (sums[0] / steps) ** 0.5,
        "yaw_rate_rmse": (sums[1] / steps) ** 0.5,
        "linear_velocity_rmse_settled": (sums[2] / settled) ** 0.5 if settled else None,
        "yaw_rate_rmse_settled": (sums[3] / settled) ** 0.5 if settled else None,
        "foot_block_per_m": sum(r.foot_block_steps for r in records) / metres if metres else None,
        "leg_block_per_m": sum(r.leg_block_steps for r in records) / metres if metres else None,
        "metres": metres,
        "mean_level": float(np.mean(levels)) if levels else None,
        "robots": len(records),
    }
    kinds = sorted({r.kind for r in records})
    figures["falls_by_kind"] = {
        kind: float(np.mean([r.falls > 0 for r in records if r.kind == kind])) for kind in kinds
    }
    return _rounded(figures)


def _rounded(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _rounded(v) for key, v in value.items()}
    return round(float(value), 6) if isinstance(value, (float, np.floating)) else value


@lru_cache(maxsize=1)
def _ground(config: GroundConfig) -> Ground:
    return build_ground(config)


def _run_group(context: Context, robots: range) -> list[RobotRecord]:
    """Some of the robots, in lockstep."""
    policy, config, ranges, steps = context.shared
    ground, n = _ground(config), len(robots)
    rngs = [np.random.Generator(np.random.Philox(np.random.SeedSequence([config.seed, k]))) for k in robots]
    homes = [k % len(ground.homes) for k in robots]
    records = [_new_record(ground, k, h) for k, h in zip(robots, homes, strict=True)]
    walkers = [Walker(ground.model) for _ in robots]
    policy.reset(n)
    for walker, rng, h in zip(walkers, rngs, homes, strict=True):
        _spawn(walker, ground, ground.homes[h], rng)
    command, age, until = np.zeros((n, 3)), np.zeros(n, int), np.zeros(n, int)
    actions = np.zeros((n, 12), np.float32)
    qpos, qvel = np.stack([w.qpos for w in walkers]), np.stack([w.qvel for w in walkers])
    for step in range(steps):
        if step % SETTLED == 0 and context.is_stopped():
            break
        for k in np.flatnonzero(until <= step):
            command[k] = _draw_command(ranges, rngs[k])
            until[k] = step + round(rngs[k].uniform(*HOLD) / CONTROL_DT)
            age[k] = 0
        scan = scan_ground(np, ground.field.heights, ground.field.frame, qpos)
        actions = policy.act(observe(np, qpos, qvel, command, actions, scan))
        targets = joint_targets(actions, policy.card)
        for k, walker in enumerate(walkers):
            before = walker.qpos[:2].copy()
            walker.step(targets[k])
            fallen = walker.has_fallen(MAX_TILT)
            record, kinds = records[k], walker.contacts.touches
            record.metres += float(np.linalg.norm(walker.qpos[:2] - before))
            record.foot_block_steps += 0 in kinds
            record.leg_block_steps += 2 in kinds
            record.falls += fallen
            qpos[k], qvel[k] = walker.qpos, walker.qvel
            home = ground.homes[homes[k]]
            if fallen or np.abs(walker.qpos[:2] - home[:2]).max() > ground.reach:
                # the step still counts below, with the state in which it ended
                _spawn(walker, ground, home, rngs[k])
                actions[k], until[k] = 0, step + 1
        _add_errors(records, qpos, qvel, command, age >= SETTLED)
        age += 1
        for k in np.flatnonzero(until == step + 1):
            qpos[k], qvel[k] = walkers[k].qpos, walkers[k].qvel
    for _ in robots:
        context.tell()
    return records


def _new_record(ground: Ground, robot: int, home: int) -> RobotRecord:
    level = int(ground.levels[home])
    return RobotRecord(robot, ground.kinds[home], level if level >= 0 else None)


def _add_errors(
    records: list[RobotRecord],
    qpos: Float[np.ndarray, "n 19"],
    qvel: Float[np.ndarray, "n 18"],
    command: Float[np.ndarray, "n 3"],
    settled: np.ndarray,
) -> None:
    """Squared errors of the velocity in the trunk frame, which training rewards, and of the yaw rate."""
    velocity = rotate_inverse(np, qpos[:, 3:7], qvel[:, :3])
    linear, yaw = ((velocity[:, :2] - command[:, :2]) ** 2).sum(1), (qvel[:, 5] - command[:, 2]) ** 2
    for record, a, b, calm in zip(records, linear.tolist(), yaw.tolist(), settled.tolist(), strict=True):
        record.steps += 1
        record.errors[0] += a
        record.errors[1] += b
        if calm:
            record.settled_steps += 1
            record.errors[2] += a
            record.errors[3] += b


def _spawn(walker: Walker, ground: Ground, home: Float[np.ndarray, "3"], rng: np.random.Generator) -> None:
    xy = home[:2]
    for _ in range(1000):
        xy = home[:2] + rng.uniform(-ground.spread, ground.spread, 2)
        if not len(ground.blocks) or np.linalg.norm(ground.blocks.rows[:, :2] - xy, axis=1).min() > 0.65:
            break
    yaw = float(rng.uniform(-np.pi, np.pi))
    walker.spawn(float(xy[0]), float(xy[1]), yaw, DEFAULT_POSE + rng.uniform(-0.05, 0.05, 12), float(home[2]))


def _draw_command(ranges: CommandRanges, rng: np.random.Generator) -> Float[np.ndarray, "3"]:
    command = np.array([rng.uniform(*ranges.forward), rng.uniform(*ranges.left), rng.uniform(*ranges.yaw_rate)])
    if np.hypot(command[0], command[1]) < ranges.min_speed:
        command[:2] = 0.0
    return command
