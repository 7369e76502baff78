"""The figures of a set of episodes, with spread over seeds and intervals."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from vinl.chain.failures import count_failures
from vinl.chain.metrics import summarise
from vinl.chain.records import EpisodeRecord
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
