"""How a locomotor carries its trunk and executes velocities: roll-outs under commands like a navigator's, and their
figures in the terms of the navigator's training environment."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from vinl.chain.choose import check_locomotion_policy
from vinl.chain.controller import open_controller
from vinl.chain.navigators.learned import measure_twist
from vinl.chain.robot import Robot, Robots
from vinl.chain.scene import build_scene
from vinl.chain.workers import Context, WorkerPool
from vinl.config.errors import InputError
from vinl.courses.courses import FIXED, draw_commands
from vinl.policies.policy import Policy
from vinl.robot.aliengo import CONTROL_DT, DEFAULT_POSE
from vinl.robot.rotation import matrix_of, yaw_of
from vinl.world.boxes import Boxes
from vinl.world.clutter import CLUTTER, choose_clutter, scatter_blocks
from vinl.world.endings import MAX_TILT
from vinl.world.floorplan import FloorPlan, assemble_floorplan, frame_around

PERIOD = 25
"""Control steps between two decisions: the navigator's 2 Hz."""

GROUP = 16
"""Robots in one unit of work; they share the clutter and do not see each other."""

_HALF = 20.0
"""Half the side of the walled square that they walk in [m]."""


@dataclass(frozen=True, eq=False)
class MotionRecord:
    """One robot, decision by decision, up to its fall if it fell.

    Attributes:
        poses: (k, 3) x, y [m], yaw [rad] when the decision is made.
        tilts: (k, 3) roll, pitch (nose down is positive) [rad] and height [m] of the trunk at that time.
        commands: (k, 2) forward speed [m/s] and yaw rate [rad/s] from then on.
        fell: whether it fell.
    """

    poses: Float[np.ndarray, "k 3"]
    tilts: Float[np.ndarray, "k 3"]
    commands: Float[np.ndarray, "k 2"]
    fell: bool


def record_motion(
    policy: Policy, clutter: str = "none", robots: int = 64, seconds: float = 30.0, seed: int = 0, workers: int = 1
) -> list[MotionRecord]:
    """Let robots walk in MuJoCo C under random commands at 2 Hz.

    Args:
        policy: the locomotor.
        clutter: preset of the blocks on the level ground.
        robots: how many.
        seconds: how long each walks [s].
        seed: of commands, starts and clutter.
        workers: processes; the records do not depend on it.

    Raises:
        InputError: an unknown preset, a number out of range, or a policy that is no locomotor.
    """
    check_locomotion_policy(policy)
    choose_clutter(clutter, "clutter")
    if robots < 1 or not 2 <= seconds <= 3600:
        raise InputError(f"at least one robot and 2 to 3600 s, got {robots} and {seconds:g}")
    jobs = [range(first, min(first + GROUP, robots)) for first in range(0, robots, GROUP)]
    with WorkerPool(min(workers, len(jobs)), (policy, clutter, round(seconds / CONTROL_DT), seed)) as pool:
        return [record for group in pool.run(_record_group, jobs, lambda: None) for record in group]


def draw_decisions(rng: np.random.Generator, count: int) -> Float[np.ndarray, "count 2"]:
    """Forward speeds [m/s] and yaw rates [rad/s] as a navigator gives them, one each 0.5 s."""
    return draw_commands(FIXED["navigator"], rng, count * PERIOD)[0][::PERIOD, [0, 2]]


def _build_square() -> FloorPlan:
    side, thick = 2 * _HALF, 0.1
    walls = [[x, 0.0, 0.0, thick, side, 0.0, 2.5] for x in (-_HALF, _HALF)]
    walls += [[0.0, y, 0.0, side, thick, 0.0, 2.5] for y in (-_HALF, _HALF)]
    frame = frame_around(np.full(2, -_HALF), np.full(2, _HALF), "square")
    x, y = frame.centres()
    inside = np.outer(np.abs(y) < _HALF, np.abs(x) < _HALF)
    return assemble_floorplan("square", "square", Boxes(np.array(walls)), Boxes.empty(), inside, frame)


def _record_group(context: Context, robots: range) -> list[MotionRecord]:
    policy, clutter, steps, seed = context.shared
    n, plan = len(robots), _build_square()
    rngs = [np.random.Generator(np.random.Philox(np.random.SeedSequence([seed, k]))) for k in robots]
    orders = np.stack([draw_decisions(rng, steps // PERIOD + 1) for rng in rngs])
    starts = np.stack([np.append(rng.uniform(-6, 6, 2), rng.uniform(-np.pi, np.pi)) for rng in rngs])
    scatter = np.random.Generator(np.random.Philox(np.random.SeedSequence([seed, robots.start, 1])))
    blocks = scatter_blocks(plan, CLUTTER[clutter], scatter, starts[:, :2])
    kp, kd = (float(policy.card.action[key]) for key in ("kp", "kd"))
    model = build_scene(plan.boxes, blocks.boxes(), kp=kp, kd=kd)
    each = [Robot(model) for _ in robots]
    for body, (x, y, yaw), rng in zip(each, starts, rngs, strict=True):
        body.spawn(float(x), float(y), float(yaw), DEFAULT_POSE + rng.uniform(-0.05, 0.05, 12))
    controller = open_controller(policy, plan, [blocks] * n)
    controller.reset(n)
    bodies, command = Robots(each), np.zeros((n, 3))
    qpos, qvel = bodies.qpos, bodies.qvel
    history, length, fell = [], np.full(n, steps // PERIOD), np.zeros(n, bool)
    alive = list(range(n))
    for step in range(steps):
        if step % PERIOD == 0:
            if context.is_stopped():
                break
            k = step // PERIOD
            history.append(_read_trunk(qpos))
            command[:, 0], command[:, 2] = orders[:, k].T
        bodies.step(controller.step(qpos, qvel, command, alive), alive)
        for k in list(alive):
            out = np.abs(qpos[k, :2]).max() > _HALF - 1.5
            if out or bodies[k].has_fallen(MAX_TILT):
                fell[k] = not out
                length[k] = max(step // PERIOD - (0 if out else 2), 0)  # the tumble is no walking
                alive.remove(k)
    read = np.stack(history, 1)
    return [MotionRecord(read[k, :m, :3], read[k, :m, 3:], orders[k, :m], bool(fell[k])) for k, m in enumerate(length)]


def _read_trunk(qpos: Float[np.ndarray, "n 19"]) -> Float[np.ndarray, "n 6"]:
    """x, y, yaw, roll, pitch and height of every trunk; turned by roll, then pitch, then yaw."""
    turn = matrix_of(np, qpos[:, 3:7])
    pitch = np.arcsin(np.clip(-turn[:, 2, 0], -1, 1))
    roll = np.arctan2(turn[:, 2, 1], turn[:, 2, 2])
    return np.column_stack([qpos[:, :2], yaw_of(np, qpos[:, 3:7]), roll, pitch, qpos[:, 2]])


STEP = PERIOD * CONTROL_DT
"""Time between two decisions [s]."""

MAX_SPEED, MAX_YAW_RATE = 1.0, np.pi / 3
_LAGS = np.linspace(0.0, 0.6, 61)
_SETTLE = 4
"""Decisions left out at the start of every record."""

_SHORTEST = 20


@dataclass(frozen=True)
class Sway:
    """One coordinate of the trunk, as a camera at 2 Hz meets it.

    Attributes:
        mean: over everything.
        offset: standard deviation of the records' means, cleared of what the motion within leaves in a mean.
        within: standard deviation about the record's mean.
        autocorrelation: of the motion within, one decision later.
        low, high: the 1st and 99th percentile of all values.
    """

    mean: float
    offset: float
    within: float
    autocorrelation: float
    low: float
    high: float


@dataclass(frozen=True)
class Execution:
    """What becomes of commanded velocities: a first-order lag, a gain, and noise as ``vinl.nav`` has them.

    Attributes:
        speed_lag, yaw_lag: time constants [s], each fitted alone.
        speed_gain, yaw_gain: achieved over commanded, with these lags.
        speed_gain_spread, yaw_gain_spread: standard deviation of the gain from record to record.
        speed_noise: of a step's mean forward speed at full speed, in proportion to the speed [m/s].
        speed_noise_standing: of robots commanded to go slower than 0.1 m/s [m/s].
        side_slip: the same of the sideways speed [m/s].
        side_drift: mean sideways speed at full speed [m/s].
        yaw_noise: of a step's mean yaw rate at full speed [rad/s].
        yaw_drift: mean yaw rate of a record at full speed [rad/s], standard deviation over records.
        yaw_bias: its mean over all records [rad/s].
    """

    speed_lag: float
    yaw_lag: float
    speed_gain: float
    yaw_gain: float
    speed_gain_spread: float
    yaw_gain_spread: float
    speed_noise: float
    speed_noise_standing: float
    side_slip: float
    side_drift: float
    yaw_noise: float
    yaw_drift: float
    yaw_bias: float


def describe_sway(records: Sequence[MotionRecord]) -> dict[str, Sway]:
    """Roll, pitch [rad] and height [m] of the trunk; records of fewer than 20 decisions are left out.

    Raises:
        ValueError: no record is long enough.
    """
    long = [r.tilts[_SETTLE:] for r in records if len(r.tilts) >= _SHORTEST]
    if not long:
        raise ValueError("no record is long enough")
    figures = {}
    for k, name in enumerate(("roll", "pitch", "height")):
        means = np.array([x[:, k].mean() for x in long])
        deviations = [x[:, k] - x[:, k].mean() for x in long]
        variance = float(np.mean(np.concatenate(deviations) ** 2))
        behind = np.concatenate([d[:-1] * d[1:] for d in deviations]).mean()
        left = variance / np.mean([len(d) for d in deviations])
        everything = np.concatenate([x[:, k] for x in long])
        low, high = np.percentile(everything, [1, 99])
        figures[name] = Sway(
            float(everything.mean()),
            float(np.sqrt(max(means.var() - left, 0.0))),
            variance**0.5,
            float(behind / variance) if variance else 0.0,
            float(low),
            float(high),
        )
    return figures


def read_twists(poses: Float[np.ndarray, "k 3"]) -> Float[np.ndarray, "steps 3"]:
    """Mean forward [m/s], sideways [m/s] and yaw [rad/s] rates between poses: the constant ones that lead from each to
    the next on an arc."""
    return measure_twist(poses[:-1], poses[1:], STEP)


def lag_commands(commands: Float[np.ndarray, "k n"], lag: float) -> Float[np.ndarray, "k n"]:
    """Mean of each step's velocity if it approaches the commanded one with a time constant [s], from rest."""
    if lag <= 0:
        return commands.copy()
    last = np.exp(-STEP / lag)
    mean = (1 - last) * lag / STEP
    now, means = np.zeros(commands.shape[1]), np.empty_like(commands)
    for k, commanded in enumerate(commands):
        means[k] = commanded + (now - commanded) * mean
        now = commanded + (now - commanded) * last
    return means


def fit_execution(records: Sequence[MotionRecord]) -> Execution:
    """Fit lag, gains and noise to all records of at least 20 decisions.

    Raises:
        ValueError: no record is long enough.
    """
    long = [r for r in records if len(r.poses) >= _SHORTEST]
    if not long:
        raise ValueError("no record is long enough")
    done = np.concatenate([read_twists(r.poses)[_SETTLE:] for r in long])
    owner = np.concatenate([np.full(len(r.poses) - 1 - _SETTLE, k) for k, r in enumerate(long)])

    def commanded(lag: float) -> np.ndarray:
        return np.concatenate([lag_commands(r.commands[:-1], lag)[_SETTLE:] for r in long])

    errors = np.empty((len(_LAGS), 2))
    for k, lag in enumerate(_LAGS):
        for column, axis in enumerate((0, 2)):
            x, y = commanded(lag)[:, column], done[:, axis]
            errors[k, column] = np.mean((y - _gain(x, y) * x) ** 2)
    lags = _LAGS[errors.argmin(0)]
    x = np.stack([commanded(float(lag))[:, column] for column, lag in enumerate(lags)], 1)
    gains = [_gain(x[:, 0], done[:, 0]), _gain(x[:, 1], done[:, 2])]
    spread = [[_gain(x[owner == k, c], done[owner == k, a]) for k in range(len(long))] for c, a in ((0, 0), (1, 2))]
    pace = np.clip(gains[0] * x[:, 0] / MAX_SPEED, 0, 1)
    residual = np.stack([done[:, 0] - gains[0] * x[:, 0], done[:, 1], done[:, 2] - gains[1] * x[:, 1]], 1)
    walking, standing = pace > 0.3, x[:, 0] < 0.1
    scaled = residual[walking] / pace[walking, None]
    side_drift, yaw_bias = _gain(pace, residual[:, 1]), _gain(pace, residual[:, 2])
    drifts = [_gain(pace[owner == k], residual[owner == k, 2]) for k in range(len(long))]
    turning = 0.5 + 0.5 * np.maximum(pace, np.abs(gains[1] * x[:, 1]) / MAX_YAW_RATE).clip(0, 1)
    return Execution(
        speed_lag=float(lags[0]),
        yaw_lag=float(lags[1]),
        speed_gain=gains[0],
        yaw_gain=gains[1],
        speed_gain_spread=float(np.std(spread[0])),
        yaw_gain_spread=float(np.std(spread[1])),
        speed_noise=float(scaled[:, 0].std()),
        speed_noise_standing=float(residual[standing, 0].std()) if standing.any() else 0.0,
        side_slip=float(scaled[:, 1].std()),
        side_drift=side_drift,
        yaw_noise=float(np.sqrt(np.mean(((residual[:, 2] - yaw_bias * pace) / turning) ** 2))),
        yaw_drift=float(np.std(drifts)),
        yaw_bias=yaw_bias,
    )


def _gain(x: np.ndarray, y: np.ndarray) -> float:
    """Slope of y over x through the origin; 0 if x is."""
    power = float(x @ x)
    return float(x @ y) / power if power > 0 else 0.0
