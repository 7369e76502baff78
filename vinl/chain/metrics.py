"""Figures of episodes, and their means with spread and intervals."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from jaxtyping import Float

from vinl.evaluation.blame import count_failures
from vinl.evaluation.records import EpisodeRecord
from vinl.world.endings import END_REASONS

BOOTSTRAP = 2000
"""Resamples of the bootstrap."""

MIN_METRES = 1.0
"""Episodes shorter than this [m] do not count in rates per metre [paper, IV-C]."""


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
    """Mean over episodes, standard deviation of the seeds' means (divided by their number, as in the paper), and the
    95 % interval of the mean: Wilson's for a share, by bootstrap over episodes otherwise. None if there is no value.
    """
    if not len(values):
        return {"mean": None, "std_over_seeds": None, "ci95": None}
    v, s = np.asarray(values, np.float64), np.asarray(seeds)
    means = [v[s == seed].mean() for seed in sorted(set(seeds))]
    interval = wilson_interval(round(v.sum()), len(v)) if share else bootstrap_interval(v)
    return {
        "mean": round(float(v.mean()), 6),
        "std_over_seeds": round(float(np.std(means)), 6),
        "ci95": [round(interval[0], 6), round(interval[1], 6)],
    }


_RATES = {
    "foot_collisions_per_m": "foot_steps",
    "foot_block_per_m": "foot_block_steps",
    "foot_wall_per_m": "foot_wall_steps",
    "leg_contacts_per_m": "leg_contact_steps",
    "paper_foot_collisions_per_m": "paper_foot_steps",
}


def aggregate_episodes(records: Sequence[EpisodeRecord], min_metres: float = MIN_METRES) -> dict[str, Any]:
    """The figures of a set of episodes.

    Rates per metre are ratios of each episode, then averaged; only episodes of at least ``min_metres`` count in them
    [paper]. ``falls`` is the share of episodes that ended in a fall.
    """

    def over(get: Callable[[EpisodeRecord], float], chosen: Sequence[EpisodeRecord], share: bool = False) -> Any:
        return summarise([float(get(r)) for r in chosen], [r.seed for r in chosen], share)

    walked = [r for r in records if r.distance_m >= min_metres]
    figures: dict[str, Any] = {
        "success": over(lambda r: r.success, records, share=True),
        "spl": over(lambda r: r.spl, records),
        "soft_spl": over(lambda r: r.soft_spl, records),
        "distance_m": over(lambda r: r.distance_m, records),
        "time_s": over(lambda r: r.time_s, records),
        "speed_rmse": over(lambda r: r.speed_rmse, records),
    }
    for name, steps in _RATES.items():
        figures[name] = over(lambda r, steps=steps: getattr(r, steps) / r.distance_m, walked)
    n = len(records)
    figures["falls"] = round(sum(r.fell for r in records) / n, 6) if n else None
    figures["episodes"] = n
    figures["episodes_in_rates"] = len(walked)
    figures["end_reasons"] = {reason: sum(r.end_reason == reason for r in records) for reason in END_REASONS}
    figures["failures"] = count_failures(records)
    return figures
