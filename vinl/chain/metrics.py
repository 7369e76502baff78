"""Figures of episodes, and their means with spread and intervals."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from jaxtyping import Float
from scipy import stats

from vinl.robot.rotation import yaw_of

BOOTSTRAP = 2000
"""Resamples of the bootstrap."""


def spl(success: bool, geodesic_m: float, distance_m: float) -> float:
    """Success weighted by path length: success x shortest / max(shortest, walked)."""
    return float(success) * geodesic_m / max(geodesic_m, distance_m, 1e-9)


def soft_spl(geodesic_m: float, left_m: float, distance_m: float) -> float:
    """SoftSPL: the fraction of the shortest distance that was covered takes the place of success.

    Args:
        geodesic_m: shortest distance at the start [m].
        left_m: shortest distance at the end [m], infinite if the goal cannot be reached from there.
        distance_m: walked [m].
    """
    progress = 1.0 - left_m / max(geodesic_m, 1e-9)
    return min(max(progress, 0.0), 1.0) * geodesic_m / max(geodesic_m, distance_m, 1e-9)


def tracking_errors(
    qpos: Float[np.ndarray, "n 19"], qvel: Float[np.ndarray, "n 18"], command: Float[np.ndarray, "n 3"]
) -> Float[np.ndarray, "n 2"]:
    """Squared errors of the horizontal velocity in the heading frame [m2/s2] and of the yaw rate [rad2/s2]."""
    yaw = yaw_of(np, qpos[:, 3:7])
    c, s = np.cos(yaw), np.sin(yaw)
    ahead, left = c * qvel[:, 0] + s * qvel[:, 1], -s * qvel[:, 0] + c * qvel[:, 1]
    linear = (ahead - command[:, 0]) ** 2 + (left - command[:, 1]) ** 2
    return np.stack([linear, (qvel[:, 5] - command[:, 2]) ** 2], 1)


def wilson_interval(successes: int, n: int) -> tuple[float, float]:
    """95 % Wilson interval of a fraction."""
    if n == 0:
        return 0.0, 1.0
    low, high = stats.binomtest(successes, n).proportion_ci(method="wilson")
    return float(low), float(high)


def bootstrap_interval(
    *samples: Float[np.ndarray, " n"], statistic: Callable[..., Any] = np.mean
) -> tuple[float, float]:
    """95 % percentile bootstrap interval of a statistic of paired samples; the resamples are the same in every run.

    Args:
        samples: (n,) each, drawn together.
        statistic: of the samples, along ``axis``; their mean by default.
    """
    if len(samples[0]) < 2:
        alone = float(statistic(*samples, axis=-1))
        return alone, alone
    found = stats.bootstrap(
        samples,
        statistic,
        n_resamples=BOOTSTRAP,
        paired=True,
        vectorized=True,
        method="percentile",
        rng=np.random.Generator(np.random.Philox(0)),
    )
    return float(found.confidence_interval.low), float(found.confidence_interval.high)


def summarise(
    values: Sequence[float], seeds: Sequence[int], fraction: bool = False
) -> dict[str, float | list[float] | None]:
    """Mean over episodes, standard deviation of the seeds' means (divided by their number, as in the paper; None of one
    seed), and the 95 % interval of the mean: Wilson's for a fraction, by bootstrap over episodes otherwise. None if
    there is no value.
    """
    if not len(values):
        return {"mean": None, "std_over_seeds": None, "ci95": None}
    v, s = np.asarray(values, np.float64), np.asarray(seeds)
    means = [v[s == seed].mean() for seed in sorted(set(seeds))]
    interval = wilson_interval(round(v.sum()), len(v)) if fraction else bootstrap_interval(v)
    return {
        "mean": round(float(v.mean()), 6),
        "std_over_seeds": round(float(np.std(means)), 6) if len(means) > 1 else None,
        "ci95": [round(interval[0], 6), round(interval[1], 6)],
    }
