"""The recorder of each robot of a locomotor's trial, and the figures of all of them with their 95 % intervals."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np
from jaxtyping import Float

from vinl.chain.metrics import BOOTSTRAP, wilson_interval
from vinl.config.output import round_numbers
from vinl.courses.block_contacts import BINS, HEIGHT_EDGES
from vinl.courses.gait_metrics import GaitRecord, aggregate_gait
from vinl.robot.aliengo import CONTROL_DT

HEIGHT_NAMES = tuple(f"{a:.2f}-{b:.2f}" for a, b in pairwise(HEIGHT_EDGES))
"""Names of the bins of block height [m]."""


@dataclass
class RobotRecord:
    """One robot's recorder, as it stands in ``results.json``. ``*_steps`` count control steps of 0.02 s."""

    robot: int
    kind: str
    level: int | None
    falls: int = 0
    metres: float = 0.0
    steps: int = 0
    settled_steps: int = 0
    foot_block_steps: int = 0
    leg_block_steps: int = 0
    over_block_steps: int = 0
    """Steps in which the middle of the trunk was above a block."""
    foot_pair_steps: list[int] = field(default_factory=lambda: [0, 0])
    """Steps in which a front foot, a rear foot touched a block."""
    leg_pair_steps: list[int] = field(default_factory=lambda: [0, 0])
    foot_height_steps: list[int] = field(default_factory=lambda: [0] * BINS)
    """Steps in which a foot touched a block of the bin of height."""
    leg_height_steps: list[int] = field(default_factory=lambda: [0] * BINS)
    errors: list[float] = field(default_factory=lambda: [0.0] * 4)
    """Sums of squared errors: linear, yaw rate; the same without the first second after a new command."""
    trunk_block_steps: int = 0
    swings: int = 0
    """Steps of single feet, a swing and the stance after it each, see ``step_counter``."""
    dirty_swings: int = 0
    """Those in which the foot or its leg touched a block."""
    dirty_foot_swings: int = 0
    """Those in which the foot did."""
    gait: GaitRecord = field(default_factory=GaitRecord)
    """How the robot walked."""


def aggregate_robots(
    records: Sequence[RobotRecord],
    height_fractions: Float[np.ndarray, " bins"] | None = None,
    covered: float | None = None,
) -> dict[str, Any]:
    """The figures of all robots. ``falls`` is the fraction of robots that fell at least once. ``dirty_steps`` is the
    fraction of the steps (see ``step_counter``) that touched a block. How they walked: see ``aggregate_gait``.

    Args:
        records: of all robots.
        height_fractions: fraction of the blocks in every bin of height; without blocks None.
        covered: fraction of the ground that blocks cover; without blocks None.
    """
    columns = _columns(records)
    n = len(records)
    weights = np.random.Generator(np.random.Philox(0)).multinomial(n, np.full(n, 1 / n), BOOTSTRAP)
    figures, intervals = {}, {}

    def add(name: str, above: str, below: str, shape: Callable[[Any], Any] = lambda x: x) -> None:
        a, b = columns[above], columns[below]
        figures[name] = float(shape(a.sum() / b.sum())) if b.sum() > 0 else None
        if figures[name] is not None:
            with np.errstate(invalid="ignore", divide="ignore"):
                drawn = shape((weights @ a) / (weights @ b))
            drawn = drawn[np.isfinite(drawn)]
            intervals[name] = [float(x) for x in np.percentile(drawn, [2.5, 97.5])] if len(drawn) else None

    fallen = int((columns["falls"] > 0).sum())
    figures["falls"], intervals["falls"] = fallen / n, list(wilson_interval(fallen, n))
    figures["fall_count"] = int(columns["falls"].sum())
    add("falls_per_minute", "falls", "steps", lambda rate: rate * 60 / CONTROL_DT)
    for name, column, over in (
        ("linear_velocity_rmse", "linear", "steps"),
        ("yaw_rate_rmse", "yaw", "steps"),
        ("linear_velocity_rmse_settled", "linear_settled", "settled"),
        ("yaw_rate_rmse_settled", "yaw_settled", "settled"),
    ):
        add(name, column, over, np.sqrt)
    for limb in ("foot", "leg"):
        for part in ("", "_front", "_rear"):
            add(f"{limb}{part}_block_per_m", f"{limb}{part}", "metres")
    add("trunk_block_per_m", "trunk", "metres")
    if covered:
        add("dirty_steps", "dirty", "swings")
        add("dirty_foot_steps", "dirty_foot", "swings")
        figures["steps"] = int(columns["swings"].sum())
        add("trunk_over_blocks", "over", "steps", lambda fraction: fraction / covered)
    figures["metres"] = float(columns["metres"].sum())
    levels = [r.level for r in records if r.level is not None]
    figures["mean_level"] = float(np.mean(levels)) if levels else None
    figures["robots"] = n
    figures |= aggregate_gait([r.gait for r in records], figures["metres"])
    kinds = sorted({r.kind for r in records})
    figures["falls_by_kind"] = {k: float(np.mean([r.falls > 0 for r in records if r.kind == k])) for k in kinds}
    if height_fractions is not None and figures["metres"] > 0:
        for limb in ("foot", "leg"):
            steps = np.sum([getattr(r, f"{limb}_height_steps") for r in records], axis=0)
            figures[f"{limb}_block_per_m_by_height"] = {
                name: float(count / fraction / figures["metres"]) if fraction > 0 else None
                for name, count, fraction in zip(HEIGHT_NAMES, steps, height_fractions, strict=True)
            }
    figures["ci95"] = intervals
    return round_numbers(figures)


def _columns(records: Sequence[RobotRecord]) -> dict[str, Float[np.ndarray, " n"]]:
    errors = np.array([r.errors for r in records], np.float64)
    named = {name: errors[:, k] for k, name in enumerate(("linear", "yaw", "linear_settled", "yaw_settled"))}
    for name, get in (
        ("falls", lambda r: r.falls),
        ("steps", lambda r: r.steps),
        ("settled", lambda r: r.settled_steps),
        ("metres", lambda r: r.metres),
        ("foot", lambda r: r.foot_block_steps),
        ("leg", lambda r: r.leg_block_steps),
        ("over", lambda r: r.over_block_steps),
        ("trunk", lambda r: r.trunk_block_steps),
        ("swings", lambda r: r.swings),
        ("dirty", lambda r: r.dirty_swings),
        ("dirty_foot", lambda r: r.dirty_foot_swings),
        ("foot_front", lambda r: r.foot_pair_steps[0]),
        ("foot_rear", lambda r: r.foot_pair_steps[1]),
        ("leg_front", lambda r: r.leg_pair_steps[0]),
        ("leg_rear", lambda r: r.leg_pair_steps[1]),
    ):
        named[name] = np.array([get(r) for r in records], np.float64)
    return named
