"""Figures of episodes, and their means with spread and intervals."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

BOOTSTRAP = 2000
"""Resamples of the bootstrap."""


def weigh_path(success: bool, geodesic_m: float, distance_m: float) -> float:
    """Success weighted by path length: success x shortest / max(shortest, walked)."""
    return float(success) * geodesic_m / max(geodesic_m, distance_m, 1e-9)


def weigh_progress(geodesic_m: float, left_m: float, distance_m: float) -> float:
    """SoftSPL: the share of the shortest distance that was covered takes the place of success.

    Args:
        geodesic_m: shortest distance at the start [m].
        left_m: shortest distance at the end [m], infinite if the goal cannot be reached from there.
        distance_m: walked [m].
    """
    progress = 1.0 - left_m / max(geodesic_m, 1e-9)
    return min(max(progress, 0.0), 1.0) * geodesic_m / max(geodesic_m, distance_m, 1e-9)


def wilson_interval(successes: int, n: int) -> tuple[float, float]:
    """95 % Wilson interval of a share."""
    if n == 0:
        return 0.0, 1.0
    z, p = 1.959963984540054, successes / n
    middle, half = p + z * z / (2 * n), z * math.sqrt(p * (1 - p) / n + z * z / (4 * n * n))
    low, high = (middle - half) / (1 + z * z / n), (middle + half) / (1 + z * z / n)
    return (0.0 if successes == 0 else low), (1.0 if successes == n else high)


def bootstrap_interval(values: Float[np.ndarray, " n"]) -> tuple[float, float]:
    """95 % percentile bootstrap interval of a mean over episodes; the resamples are the same in every run."""
    rng = np.random.Generator(np.random.Philox(0))
    draws = rng.integers(len(values), size=(BOOTSTRAP, len(values)))
    low, high = np.percentile(values[draws].mean(1), [2.5, 97.5])
    return float(low), float(high)


def summarise(
    values: Sequence[float], seeds: Sequence[int], share: bool = False
) -> dict[str, float | list[float] | None]:
    """Mean over episodes, standard deviation of the seeds' means (divided by their number, as in the paper; None of one
    seed), and the 95 % interval of the mean: Wilson's for a share, by bootstrap over episodes otherwise. None if there
    is no value.
    """
    if not len(values):
        return {"mean": None, "std_over_seeds": None, "ci95": None}
    v, s = np.asarray(values, np.float64), np.asarray(seeds)
    means = [v[s == seed].mean() for seed in sorted(set(seeds))]
    interval = wilson_interval(round(v.sum()), len(v)) if share else bootstrap_interval(v)
    return {
        "mean": round(float(v.mean()), 6),
        "std_over_seeds": round(float(np.std(means)), 6) if len(means) > 1 else None,
        "ci95": [round(interval[0], 6), round(interval[1], 6)],
    }
