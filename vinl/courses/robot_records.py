"""What is counted of each robot of a locomotor's trial: touches, steps of the feet, how it walks; and the figures of
all of them with their 95 % intervals."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, fields
from itertools import pairwise
from typing import Any

import numpy as np
from jaxtyping import Bool, Float

from vinl.chain.metrics import BOOTSTRAP, wilson_interval
from vinl.config.output import round_numbers
from vinl.courses.block_contacts import BINS, HEIGHT_EDGES, Strain
from vinl.robot.aliengo import CONTROL_DT, GRAVITY, HIPS, MASS, foot_positions
from vinl.robot.rotation import matrix_of

CLOSE = 0.06
"""Middles of two feet nearer than this [m] are as good as a foot on a foot, whose radius is 0.0265 m."""

_PAIRS = np.triu_indices(4, 1)


@dataclass
class GaitRecord:
    """One robot's sums. ``*_steps`` count control steps of 0.02 s."""

    steps: int = 0
    work_j: float = 0.0
    overspeed_steps: int = 0
    """A joint was faster than the data sheet allows."""
    joint_speed_peak: float = 0.0
    """The fastest joint, as a fraction of what the data sheet allows."""
    leg_leg_steps: int = 0
    """A leg touched another."""
    own_body_steps: int = 0
    """A leg touched another, the trunk, or itself."""
    feet_close_steps: int = 0
    """The middles of two feet were nearer than 6 cm to each other."""
    foot_distance_min: float | None = None
    """The least distance between the middles of two feet [m]."""
    foot_above_hip_steps: int = 0
    """A foot was higher than its hip joint."""


def record_gait(
    records: Sequence[GaitRecord], strain: Strain, qpos: Float[np.ndarray, "n 19"], rows: Sequence[int] | None = None
) -> None:
    """Add one control step, at whose end the robots are at ``qpos``, to the records of all robots, or to those of
    ``rows``."""
    feet = foot_positions(np, qpos)
    hips = qpos[:, None, 2] + matrix_of(np, qpos[:, 3:7])[:, 2] @ HIPS.T
    nearest = np.linalg.norm(feet[:, _PAIRS[0]] - feet[:, _PAIRS[1]], axis=-1).min(1)
    above = (feet[..., 2] > hips).any(1)
    for k in range(len(records)) if rows is None else rows:
        record, gap = records[k], float(nearest[k])
        record.steps += 1
        record.work_j += float(strain.work[k])
        record.overspeed_steps += int(strain.speed[k] > 1)
        record.joint_speed_peak = max(record.joint_speed_peak, float(strain.speed[k]))
        record.leg_leg_steps += int(strain.leg_leg[k])
        record.own_body_steps += int(strain.own_body[k])
        record.feet_close_steps += int(gap < CLOSE)
        record.foot_distance_min = gap if record.foot_distance_min is None else min(record.foot_distance_min, gap)
        record.foot_above_hip_steps += int(above[k])


def aggregate_gait(records: Sequence[GaitRecord], metres: float) -> dict[str, Any]:
    """The figures of all robots, which walked so many metres together.

    ``cost_of_transport`` is the joints' mechanical work over weight and way; ``leg_leg_per_m`` and ``own_body_per_m``
    are control steps per metre; ``joint_overspeed``, ``feet_close`` and ``foot_above_hip`` are fractions of the control
    steps.
    """
    steps = sum(r.steps for r in records)
    if not steps:
        return {}

    def total(name: str) -> float:
        return float(sum(getattr(r, name) for r in records))

    def over(name: str, by: float) -> float | None:
        return total(name) / by if by > 0 else None

    return {
        "cost_of_transport": over("work_j", MASS * GRAVITY * metres),
        "leg_leg_per_m": over("leg_leg_steps", metres),
        "own_body_per_m": over("own_body_steps", metres),
        "joint_overspeed": over("overspeed_steps", steps),
        "joint_speed_peak": max(r.joint_speed_peak for r in records),
        "feet_close": over("feet_close_steps", steps),
        "foot_distance_min": min(r.foot_distance_min for r in records if r.foot_distance_min is not None),
        "foot_above_hip": over("foot_above_hip_steps", steps),
    }


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
    fraction of the steps (see ``StepCounter``) that touched a block. How they walked: see ``aggregate_gait``.

    ``height_fractions`` are the fractions of the blocks in every bin of height, ``covered`` that of the ground under
    blocks; None without blocks.
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
        ("linear_velocity_rmse_settled", "linear_settled", "settled_steps"),
        ("yaw_rate_rmse_settled", "yaw_settled", "settled_steps"),
    ):
        add(name, column, over, np.sqrt)
    for limb in ("foot", "leg"):
        for part, column in (("", f"{limb}_block_steps"), ("_front", f"{limb}_front"), ("_rear", f"{limb}_rear")):
            add(f"{limb}{part}_block_per_m", column, "metres")
    add("trunk_block_per_m", "trunk_block_steps", "metres")
    if covered:
        add("dirty_steps", "dirty_swings", "swings")
        add("dirty_foot_steps", "dirty_foot_swings", "swings")
        figures["steps"] = int(columns["swings"].sum())
        add("trunk_over_blocks", "over_block_steps", "steps", lambda fraction: fraction / covered)
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
    """A column for each number of the records, those in lists by names of their own."""

    def read(name: str) -> np.ndarray:
        return np.array([getattr(r, name) for r in records], np.float64)

    columns = {f.name: read(f.name) for f in fields(RobotRecord) if f.type in ("int", "float")}
    columns |= zip(("linear", "yaw", "linear_settled", "yaw_settled"), read("errors").T, strict=True)
    for limb in ("foot", "leg"):
        columns |= zip((f"{limb}_front", f"{limb}_rear"), read(f"{limb}_pair_steps").T, strict=True)
    return columns


_STEADY = 2
"""A foot has lifted off, or come down, when it was so for this many control steps in a row."""


class StepCounter:
    """Counts the steps of n robots, the dirty ones, and those dirty by the foot itself.

    A step is one swing of a foot and the stance after it, from one lift-off to the next. It is dirty if, meanwhile,
    this foot or its leg (hip, thigh, shank) touched an object. A foot that is stopped by an object for two control
    steps or more and then lifted again has made two steps.
    """

    def __init__(self, n: int) -> None:
        self.steps, self.dirty, self.dirty_foot = (np.zeros(n, int) for _ in range(3))
        self._down, self._changing = np.ones((n, 4), bool), np.zeros((n, 4), int)
        self._open = np.zeros((n, 4), bool)
        self._touched, self._lifting = np.zeros((2, n, 4), bool), np.zeros((2, n, 4), bool)  # by foot, by leg

    def add(
        self,
        stance: Bool[np.ndarray, "n 4"],
        feet: Bool[np.ndarray, "n 4"],
        legs: Bool[np.ndarray, "n 4"],
        counted: Bool[np.ndarray, " n"],
    ) -> None:
        """One control step of all robots: which feet carry, on whatever, which feet and legs touch an object, and whose
        steps count that begin now."""
        self._changing = np.where(stance == self._down, 0, self._changing + 1)
        # touches of a lift-off belong to the new step, as soon as it is one
        lifting, touches = self._down & (self._changing > 0), np.stack([feet, legs])
        self._touched |= (touches | self._lifting) & ~lifting
        self._lifting = (touches | self._lifting) & lifting
        changed = self._changing >= _STEADY
        lifted = changed & self._down
        self._close(lifted)
        self._touched[:, lifted] = self._lifting[:, lifted]
        self._open |= lifted & counted[:, None]
        self._changing[changed], self._lifting[:, changed] = 0, False
        self._down ^= changed

    def restart(self, which: Bool[np.ndarray, " n"], fallen: Bool[np.ndarray, " n"]) -> None:
        """Some robots stand anew. Steps that they had begun are dropped, those in which they fell count."""
        rows = np.broadcast_to(which[:, None], self._open.shape)
        self._close(rows & fallen[:, None])
        self._open[which], self._touched[:, which], self._lifting[:, which] = False, False, False
        self._down[which], self._changing[which] = True, 0

    def _close(self, ended: Bool[np.ndarray, "n 4"]) -> None:
        done = self._open & ended
        for counts, flags in (
            (self.steps, done),
            (self.dirty, done & self._touched.any(0)),
            (self.dirty_foot, done & self._touched[0]),
        ):
            counts += flags.sum(1)
        self._open[ended], self._touched[:, ended] = False, False
