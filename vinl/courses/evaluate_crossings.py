"""Locomotion policies over bars of several heights: many crossings each, in worker processes, and the figures."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from vinl.chain.choose import check_locomotion_policy
from vinl.chain.metrics import bootstrap_interval, wilson_interval
from vinl.chain.workers import Context
from vinl.config.errors import InputError
from vinl.config.limits import check_number
from vinl.config.output import round_numbers
from vinl.courses.crossing import (
    APPROACH,
    PATIENCE,
    SPREAD,
    WIDTH,
    BarConfig,
    CrossingRecord,
    CrossingTrace,
    build_corridor,
    cross_bar,
)
from vinl.courses.evaluate import Group, TrialResults, cut_groups, run_groups
from vinl.courses.robot_records import aggregate_gait
from vinl.policies.identity import describe_policy
from vinl.policies.policy import Policy

MAX_CROSSINGS, MAX_HEIGHTS = 100_000, 100

TRACED = 8
"""So many crossings of each height are kept for pictures."""

_CLEAN = {
    "clean_crossings": lambda r: not r.touches,
    "clean_foot_crossings": lambda r: not r.foot_steps,
    "clean_leg_crossings": lambda r: not r.leg_steps,
    "clean_trunk_crossings": lambda r: not r.trunk_steps,
}
_STEPS = {
    "foot_steps_per_crossing": lambda r: r.foot_steps,
    "foot_front_steps_per_crossing": lambda r: r.foot_pair_steps[0],
    "foot_rear_steps_per_crossing": lambda r: r.foot_pair_steps[1],
    "leg_steps_per_crossing": lambda r: r.leg_steps,
    "leg_front_steps_per_crossing": lambda r: r.leg_pair_steps[0],
    "leg_rear_steps_per_crossing": lambda r: r.leg_pair_steps[1],
    "trunk_steps_per_crossing": lambda r: r.trunk_steps,
    "wall_steps_per_crossing": lambda r: r.wall_steps,
}


@dataclass(frozen=True, eq=False)
class CrossingResults(TrialResults[CrossingRecord]):
    """Also the traces of the first ``TRACED`` crossings of every height [m]; empty if none were asked for."""

    traces: dict[float, list[CrossingTrace]]


@dataclass(frozen=True)
class _Shared:
    policies: list[Policy]
    traced: bool


@dataclass(frozen=True)
class _BarGroup(Group):
    bar: BarConfig


def compare_crossings(
    policies: Sequence[Policy],
    heights: Sequence[float] = (0.1,),
    depth: float = 0.2,
    speed: float = 0.5,
    crossings: int = 32,
    seed: int = 0,
    traced: bool = False,
    workers: int = 1,
    on_progress: Callable[[str, int, int], None] = lambda *_: None,
) -> list[CrossingResults]:
    """Let robots cross bars of these heights and of one depth [m] in a corridor 1 m wide, at a commanded speed [m/s].
    All policies meet the same starts at every height, as many as there are ``crossings``.

    With ``traced`` what pictures of the first ``TRACED`` crossings of every height need is kept. Results do not depend
    on the number of workers. ``on_progress`` is called with ``"crossing"``, crossings done and crossings in all. Raises
    ``InputError`` if a number is out of range, or a policy observes what there is not.
    """
    if not 1 <= len(heights) <= MAX_HEIGHTS or len(set(heights)) < len(heights):
        raise InputError(f"--height takes 1 to {MAX_HEIGHTS} different heights [m], got {len(heights)}")
    check_number("--crossings", crossings, 1, MAX_CROSSINGS)
    check_number("--seed", seed, 0, 2**31 - 1)
    check_number("--workers", workers, 1, 1024)
    for policy in policies:
        check_locomotion_policy(policy)
    bars = [
        [BarConfig(h, depth, speed, seed, float(p.card.action["kp"]), float(p.card.action["kd"])) for h in heights]
        for p in policies
    ]
    jobs = [
        _BarGroup(p, numbers, bar) for p in range(len(policies)) for bar in bars[p] for numbers in cut_groups(crossings)
    ]
    shared, total = _Shared(list(policies), traced), crossings * len(heights) * len(policies)
    parts, wall = run_groups(_run_group, shared, jobs, workers, lambda done: on_progress("crossing", done, total))
    results = []
    for p, (policy, own) in enumerate(zip(policies, parts, strict=True)):
        records = [record for record, _ in own]
        config = {
            "terrain": "bars",
            "heights": list(heights),
            "depth": depth,
            "speed": speed,
            "crossings": crossings,
            "seed": seed,
            "corridor": {"width": WIDTH, "approach": APPROACH, "spread": SPREAD, "patience": PATIENCE},
            "gains": {"kp": bars[p][0].kp, "kd": bars[p][0].kd},
        }
        figures = aggregate_crossings(records)
        figures["by_height"] = {f"{h:g}": aggregate_crossings([r for r in records if r.height == h]) for h in heights}
        traces = {h: [t for record, t in own if t is not None and record.height == h] for h in heights if traced}
        results.append(CrossingResults(records, figures, {"locomotion": describe_policy(policy)}, config, wall, traces))
    return results


def aggregate_crossings(records: Sequence[CrossingRecord]) -> dict[str, Any]:
    """The figures of a set of crossings, with 95 % intervals in ``ci95``: Wilson's for fractions, bootstrap for means.

    ``finished`` and ``falls`` are fractions of the crossings. ``clean_*`` are the fractions that were finished and
    touched the bar with nothing, with no foot, with no leg, not with the trunk. ``*_steps_per_crossing`` are means of
    control steps. How the robots walked is in the figures of ``aggregate_gait``.
    """
    n = len(records)
    figures: dict[str, Any] = {"crossings": n}
    intervals: dict[str, list[float]] = {}
    fractions = {"finished": lambda r: r.finished, "falls": lambda r: r.fell}
    for name, get in _CLEAN.items():
        fractions[name] = lambda r, get=get: r.finished and get(r)
    for name, get in fractions.items():
        count = sum(bool(get(r)) for r in records)
        figures[name], intervals[name] = count / n, list(wilson_interval(count, n))
    for name, get in _STEPS.items():
        values = np.array([get(r) for r in records], np.float64)
        figures[name], intervals[name] = float(values.mean()), list(bootstrap_interval(values))
    metres = float(sum(r.metres for r in records))
    seconds = float(sum(r.time_s for r in records))
    figures |= {"metres": metres, "speed": metres / seconds if seconds else None}
    figures |= aggregate_gait([r.gait for r in records], metres)
    figures["ci95"] = intervals
    return round_numbers(figures)


_corridor = lru_cache(maxsize=4)(build_corridor)


def _run_group(context: Context, job: _BarGroup) -> list[tuple[CrossingRecord, CrossingTrace | None]]:
    """Some of the crossings of one policy at one height, in lockstep. Of traces only those asked for go back."""
    shared: _Shared = context.shared
    done = cross_bar(shared.policies[job.policy], job.bar, _corridor(job.bar), job.numbers, context.is_stopped)
    for _ in done:
        context.report()
    return [(c.record, c.trace if shared.traced and c.record.crossing < TRACED else None) for c in done]
