"""Figures of episodes, their means with spread and intervals, and what was at fault where an episode failed."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from jaxtyping import Float
from scipy import stats

from vinl.chain.records import EpisodeRecord
from vinl.chain.robot import KINDS
from vinl.robot.rotation import yaw_of
from vinl.world.boxes import Blocks
from vinl.world.endings import FALL, LOOPING, STUCK, TIMEOUT
from vinl.world.free_space import FreeSpace

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


BLOCK, WALL, FREE = "block", "wall", "free"
CAUSES = (BLOCK, WALL, FREE)
"""Furniture counts as wall. ``free``: neither was touched or near."""

FALL_WINDOW = 1.0
"""What a robot touched in so many last seconds [s] is what it fell over."""

NEAR = 0.5
"""A block or a wall within this distance of the trunk's middle [m] is near: the robot is 0.65 m long."""

FAILURES = (
    *((FALL, cause, f"fell, {text}") for cause, text in ((BLOCK, "on a block"), (WALL, "at a wall"), (FREE, "free"))),
    *((STUCK, cause, f"stuck {text}") for cause, text in ((BLOCK, "on a block"), (WALL, "at a wall"), (FREE, "free"))),
    (LOOPING, "", "looping"),
    (TIMEOUT, "", "out of time"),
)
"""Every kind of failure: end reason, cause, and its title in the tables."""


def find_cause(
    at: Float[np.ndarray, "2"], touches: Float[np.ndarray, "m 4"], since: float, space: FreeSpace, blocks: Blocks
) -> str:
    """Block, wall or neither.

    What was touched in more control steps counts; what was not touched, but is nearest and near, counts otherwise: a
    navigator may stand before a wall for ever without touching it.

    Args:
        at: where the episode ended [m].
        touches: as in ``EpisodeTrace.contacts``.
        since: time from which touches count [s].
    """
    late = touches[touches[:, 0] > since + 1e-9]
    on_block = np.array([name.endswith(BLOCK) for name in KINDS])[late[:, 1].astype(int)]
    steps = {BLOCK: len(np.unique(late[on_block, 0])), WALL: len(np.unique(late[~on_block, 0]))}
    if any(steps.values()):
        return max(steps, key=lambda cause: steps[cause])
    row, column = space.plan.frame.cell(at)
    inside = 0 <= row < space.clearance.shape[0] and 0 <= column < space.clearance.shape[1]
    away = {BLOCK: measure_distance(at, blocks), WALL: float(space.clearance[row, column]) if inside else 0.0}
    nearest = min(away, key=lambda cause: away[cause])
    return nearest if away[nearest] <= NEAR else FREE


def measure_distance(at: Float[np.ndarray, "2"], blocks: Blocks) -> float:
    """From a point to the nearest block's footprint [m]; infinite without blocks."""
    if not len(blocks):
        return float("inf")
    return float(blocks.boxes().distances(at[None]).min())


def count_failures(records: Sequence[EpisodeRecord]) -> dict[str, Any]:
    """How many episodes failed in each way: by cause for falls and robots that were stuck."""
    counts: dict[str, Any] = {FALL: dict.fromkeys(CAUSES, 0), STUCK: dict.fromkeys(CAUSES, 0), LOOPING: 0, TIMEOUT: 0}
    for record in records:
        if record.end_reason in (FALL, STUCK):
            counts[record.end_reason][record.end_at or FREE] += 1
        elif not record.success:
            counts[record.end_reason] += 1
    return counts


def read_failure(counts: dict[str, Any], reason: str, cause: str) -> int:
    """One of the numbers that ``count_failures`` returned."""
    return counts[reason][cause] if cause else counts[reason]
