"""The figures of a set of episodes, with spread over seeds and intervals, and two rows compared on the same ones."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from scipy import stats

from vinl.chain.metrics import bootstrap_interval, count_failures, summarise
from vinl.chain.records import EpisodeRecord, Key
from vinl.world.endings import END_REASONS

MIN_METRES = 1.0
"""Episodes shorter than this [m] do not count in rates per metre [paper, IV-C]."""

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
    [paper]. ``falls`` is the fraction of episodes that ended in a fall.
    """

    def over(get: Callable[[EpisodeRecord], float], chosen: Sequence[EpisodeRecord], fraction: bool = False) -> Any:
        return summarise([float(get(r)) for r in chosen], [r.seed for r in chosen], fraction)

    walked = [r for r in records if r.distance_m >= min_metres]
    figures: dict[str, Any] = {
        "success": over(lambda r: r.success, records, fraction=True),
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


def compare_rows(
    one: Sequence[EpisodeRecord], other: Sequence[EpisodeRecord], min_metres: float = MIN_METRES
) -> dict[str, Any]:
    """Differences ``one`` - ``other`` over the episodes that both have: same plan, start, goal, heading and, where
    the clutter preset is the same, the same blocks.

    Returns:
        ``episodes``: how many. ``success``: difference of the fractions with its 95 % interval, ``only_one`` and
        ``only_other`` (episodes in which only that one succeeded) and ``p``, McNemar's exact test of the two.
        ``spl``, ``foot_collisions_per_m``, ``paper_foot_collisions_per_m``: mean difference with its interval and
        ``episodes``; the rates over those in which both walked at least ``min_metres``.
    """
    pairs = pair_records(one, other)
    rates = [(a, b) for a, b in pairs if min(a.distance_m, b.distance_m) >= min_metres]
    only_one = sum(a.success and not b.success for a, b in pairs)
    only_other = sum(b.success and not a.success for a, b in pairs)
    found = {
        "episodes": len(pairs),
        "success": {
            **difference(pairs, lambda r: float(r.success)),
            "only_one": only_one,
            "only_other": only_other,
            "p": round(mcnemar_p(only_one, only_other), 6),
        },
        "spl": difference(pairs, lambda r: r.spl),
        "foot_collisions_per_m": difference(rates, lambda r: r.foot_steps / r.distance_m),
        "paper_foot_collisions_per_m": difference(rates, lambda r: r.paper_foot_steps / r.distance_m),
    }
    return found


def pair_records(
    one: Sequence[EpisodeRecord], other: Sequence[EpisodeRecord]
) -> list[tuple[EpisodeRecord, EpisodeRecord]]:
    """The episodes that both have, in the order of ``one``."""
    known: dict[Key, EpisodeRecord] = {r.key: r for r in other}
    return [(r, known[r.key]) for r in one if r.key in known]


def difference(
    pairs: Sequence[tuple[EpisodeRecord, EpisodeRecord]], get: Callable[[EpisodeRecord], float]
) -> dict[str, Any]:
    """Mean difference of a figure and its 95 % interval by bootstrap.

    Start/goal pairs are drawn, each with all its seeds: the same way walked five times is not five ways.
    """
    if not pairs:
        return {"difference": None, "ci95": None, "episodes": 0}
    routes: dict[tuple[str, int], list[float]] = {}
    for a, b in pairs:
        routes.setdefault((a.plan, a.episode), []).append(get(a) - get(b))
    sums = np.array([sum(values) for values in routes.values()], np.float64)
    counts = np.array([len(values) for values in routes.values()], np.float64)
    low, high = bootstrap_interval(sums, counts, statistic=lambda s, c, axis: s.sum(axis) / c.sum(axis))
    return {
        "difference": round(float(sums.sum() / counts.sum()), 6),
        "ci95": [round(float(low), 6), round(float(high), 6)],
        "episodes": len(pairs),
    }


def mcnemar_p(only_one: int, only_other: int) -> float:
    """McNemar's exact test: how likely so uneven a split of the episodes in which only one of the two succeeded is, if
    both were equally good [two-sided binomial]."""
    n = only_one + only_other
    return float(stats.binomtest(only_one, n).pvalue) if n else 1.0
