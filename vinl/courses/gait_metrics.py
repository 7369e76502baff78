"""How a robot walks, whatever it walks on: effort, joint speeds, legs that touch each other, feet that come close."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from vinl.courses.strain import Strain
from vinl.robot.aliengo import MASS
from vinl.robot.kinematics import HIPS, foot_positions
from vinl.robot.rotation import matrix_of

GRAVITY = 9.81
"""[m/s2]."""

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
    """Add one control step.

    Args:
        records: of all robots.
        strain: of the control step.
        qpos: where the robots are at its end.
        rows: the robots to count; all by default.
    """
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
    """The figures of all robots.

    ``cost_of_transport`` is the joints' mechanical work over weight and way; ``leg_leg_per_m`` and ``own_body_per_m``
    are control steps per metre; ``joint_overspeed``, ``feet_close`` and ``foot_above_hip`` are fractions of the control
    steps.

    Args:
        records: of all robots.
        metres: that they walked together.
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
