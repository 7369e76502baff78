"""What the locomotor observes: one table, and the function that fills it, for numpy and jax.numpy alike."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from vinl.robot.aliengo import DEFAULT_POSE, FOOT_RADIUS, LEGS
from vinl.robot.kinematics import foot_positions
from vinl.robot.rotation import rotate_inverse


@dataclass(frozen=True)
class ObservationTerm:
    """One row of the table.

    Attributes:
        name: what is observed.
        size: how many numbers.
        scale: factor from SI units to the network's input, one for each number or one for all.
        noise: half-width of the uniform noise while training, in SI units.
        unit: SI unit before scaling.
    """

    name: str
    size: int
    scale: tuple[float, ...]
    noise: float
    unit: str


SCAN_REACH = (0.8, 0.5)
"""Half-lengths of the rectangle about the trunk that the published height scan covers, along x and y [m] [ViNL
config]."""

SCAN_OFFSET = 0.5
"""The scan reads trunk height minus this minus ground height, held to +-1 m [ViNL code]."""

FOOT_POINTS = np.stack(np.meshgrid(np.arange(-3, 4) * 0.05, np.arange(-2, 3) * 0.05, indexing="ij"), -1).reshape(-1, 2)
"""(35, 2) points about a foot at which a scan with ``feet`` reads the ground, in the heading frame [m], x outer: 5 cm
apart, as the ground's cells, and as far as a foot has to go to leave a block [the idea: Miki et al. 2022]."""

_PROPRIOCEPTION = (
    ObservationTerm("base_linear_velocity", 3, (2.0,), 0.1, "m/s"),
    ObservationTerm("base_angular_velocity", 3, (0.25,), 0.2, "rad/s"),
    ObservationTerm("projected_gravity", 3, (1.0,), 0.05, "1"),
    ObservationTerm("command", 3, (2.0, 2.0, 0.25), 0.0, "m/s, m/s, rad/s"),
    ObservationTerm("joint_position", 12, (1.0,), 0.01, "rad"),
    ObservationTerm("joint_velocity", 12, (0.05,), 1.5, "rad/s"),
    ObservationTerm("previous_action", 12, (1.0,), 0.0, "1"),
)
PROPRIOCEPTION_SIZE = sum(term.size for term in _PROPRIOCEPTION)
CLIP = 100.0
"""Observations are held to +- this [ViNL config]."""


@dataclass(frozen=True)
class HeightScan:
    """Where a locomotor reads the ground, and the whole observation that ends with what it reads there.

    Attributes:
        spacing: of the points, along x and y [m].
        ahead: how far the points reach before the middle of the trunk [m].
        feet: whether it also reads the ground at ``FOOT_POINTS`` about each foot.
    """

    spacing: float
    ahead: float = SCAN_REACH[0]
    feet: bool = False

    @cached_property
    def points(self) -> np.ndarray:
        """(k, 2) about the trunk, in the heading frame [m], x outer, y inner."""
        behind, aside, ahead = (round(reach / self.spacing) for reach in (*SCAN_REACH, self.ahead))
        x, y = np.arange(-behind, ahead + 1) * self.spacing, np.arange(-aside, aside + 1) * self.spacing
        return np.stack(np.meshgrid(x, y, indexing="ij"), -1).reshape(-1, 2)

    @property
    def reach(self) -> float:
        """How far the farthest point lies from the middle of the trunk [m]."""
        return max(float(np.linalg.norm(self.points, axis=1).max()), _FEET_REACH if self.feet else 0.0)

    @property
    def foot_size(self) -> int:
        """Numbers about the feet."""
        return len(LEGS) * len(FOOT_POINTS) if self.feet else 0

    @property
    def size(self) -> int:
        """Numbers of the scan alone."""
        return len(self.points) + self.foot_size

    @property
    def observation_size(self) -> int:
        """Numbers of the whole observation."""
        return PROPRIOCEPTION_SIZE + self.size

    @cached_property
    def table(self) -> tuple[ObservationTerm, ...]:
        """The numbers in their order, with scales and training noise of legged_gym [ViNL config]."""
        trunk = ObservationTerm("height_scan", len(self.points), (5.0,), 0.1, "m")
        feet = ObservationTerm("foot_scan", self.foot_size, (5.0,), 0.05, "m")
        return (*_PROPRIOCEPTION, trunk, feet) if self.feet else (*_PROPRIOCEPTION, trunk)

    @cached_property
    def scale(self) -> np.ndarray:
        """(observation_size,) factor of every number."""
        return self._per_number([term.scale for term in self.table])

    @cached_property
    def noise(self) -> np.ndarray:
        """(observation_size,) half-width of the training noise of every number, after scaling."""
        return self.scale * self._per_number([(term.noise,) for term in self.table])

    @property
    def settings(self) -> str:
        """The settings of a training that give this scan."""
        return f"scan_spacing={self.spacing:g} scan_ahead={self.ahead:g} scan_feet={str(self.feet).lower()}"

    def covers(self, other: HeightScan) -> bool:
        """Whether all points of another scan are among these."""
        return self.feet >= other.feet and bool(self._apart_from(other).min(1).max() < 1e-6)

    def places_of(self, other: HeightScan) -> np.ndarray:
        """(other.size,) which of these points are those of another scan, in its order.

        Raises:
            ValueError: some of its points are not among these.
        """
        if not self.covers(other):
            raise ValueError(f"{self} lacks points of {other}")
        return np.append(self._apart_from(other).argmin(1), len(self.points) + np.arange(other.foot_size))

    def _apart_from(self, other: HeightScan) -> np.ndarray:
        return np.abs(self.points[None] - other.points[:, None]).max(-1)

    def _per_number(self, values: list[tuple[float, ...]]) -> np.ndarray:
        parts = [np.broadcast_to(v, term.size) for v, term in zip(values, self.table, strict=True)]
        return np.concatenate(parts).astype(np.float32)


_FEET_REACH = 1.2
"""No point about a foot lies farther from the middle of the trunk [m]: a leg is half a metre long."""

SCANS = tuple(
    HeightScan(spacing, ahead, feet)
    for feet in (False, True)
    for ahead in (SCAN_REACH[0], 1.6)
    for spacing in (0.1, 0.05)
)
"""The scans that there are. The first is the published one [ViNL config]; others are as fine as the ground's cells of
5 cm, reach as far ahead as the locomotion camera sees the floor's blocks, have points about the feet, or several of
these."""

STANDARD_SCAN = SCANS[0]
SCAN_POINTS, TABLE = STANDARD_SCAN.points, STANDARD_SCAN.table
SCAN_SIZE, OBSERVATION_SIZE = STANDARD_SCAN.size, STANDARD_SCAN.observation_size
SCALE, NOISE = STANDARD_SCAN.scale, STANDARD_SCAN.noise


def find_scan(observation_size: int) -> HeightScan | None:
    """The scan that an observation of so many numbers ends with; None: no observation with a scan has so many."""
    return next((scan for scan in SCANS if scan.observation_size == observation_size), None)


def observe(xp: Any, qpos: Any, qvel: Any, command: Any, previous_action: Any, ground: Any) -> Any:
    """The observation of every robot, without noise.

    Args:
        xp: ``numpy`` or ``jax.numpy``.
        qpos: (n, 19) trunk position [m] and quaternion, joint angles [rad].
        qvel: (n, 18) trunk velocity in the world [m/s], angular velocity in the body [rad/s], joint speeds [rad/s]
            (MuJoCo's convention for a free joint).
        command: (n, 3) forward [m/s], left [m/s], yaw rate [rad/s].
        previous_action: (n, 12) the network's last output.
        ground: (n, k) height of the ground under the k points of one of ``SCANS`` [m], as ``scan_ground`` reads it.

    Returns:
        (n, 48 + k) in the order of that scan's table.

    Raises:
        ValueError: no scan has k points.
    """
    scan = find_scan(PROPRIOCEPTION_SIZE + ground.shape[-1])
    if scan is None:
        raise ValueError(f"no height scan has {ground.shape[-1]} points")
    trunk = len(scan.points)
    quaternion = qpos[:, 3:7]
    down = xp.broadcast_to(xp.asarray([0.0, 0.0, -1.0], dtype=qpos.dtype), qpos[:, :3].shape)
    parts = [
        rotate_inverse(xp, quaternion, qvel[:, :3]),
        qvel[:, 3:6],
        rotate_inverse(xp, quaternion, down),
        command,
        qpos[:, 7:] - xp.asarray(DEFAULT_POSE, dtype=qpos.dtype),
        qvel[:, 6:],
        previous_action,
        xp.clip(qpos[:, 2:3] - SCAN_OFFSET - ground[:, :trunk], -1.0, 1.0),
    ]
    if scan.feet:  # how high the foot is above the ground there
        soles = xp.repeat(foot_positions(xp, qpos)[..., 2] - FOOT_RADIUS, len(FOOT_POINTS), axis=1)
        parts.append(xp.clip(soles - ground[:, trunk:], -1.0, 1.0))
    return xp.clip(xp.concatenate(parts, -1) * xp.asarray(scan.scale, dtype=qpos.dtype), -CLIP, CLIP)


def describe(scan: HeightScan = STANDARD_SCAN) -> list[dict[str, Any]]:
    """The table as plain data, for policy cards and the docs."""
    return [
        {"name": t.name, "size": t.size, "scale": list(t.scale), "noise": t.noise, "unit": t.unit} for t in scan.table
    ]
