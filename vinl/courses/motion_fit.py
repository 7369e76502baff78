"""Figures of recorded trunk motion, in the terms of the navigator's training environment."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from vinl.chain.odometry import measure_twist
from vinl.courses.trunk_motion import PERIOD, MotionRecord
from vinl.robot.aliengo import CONTROL_DT

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
        lag: the one that fits both best [s].
        speed_gain, yaw_gain: achieved over commanded, with the common lag.
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
    lag: float
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
    lag = float(_LAGS[(errors / errors.min(0)).sum(1).argmin()])
    x = commanded(lag)
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
        speed_lag=float(_LAGS[errors[:, 0].argmin()]),
        yaw_lag=float(_LAGS[errors[:, 1].argmin()]),
        lag=lag,
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
