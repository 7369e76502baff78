"""What a robot knows of itself and of the ground about it: a table, and what fills it, for numpy and for jax.numpy."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from vinl.robot.aliengo import DEFAULT_POSE
from vinl.robot.rotation import rotate_inverse


@dataclass(frozen=True)
class ObservationTerm:
    """One row of the table: name and size, the factor from SI units to the network's input (one for each number or one
    for all), the half-width of the uniform noise while training in SI units, and the SI unit before scaling."""

    name: str
    size: int
    scale: tuple[float, ...]
    noise: float
    unit: str


SCAN_REACH = (0.8, 0.5)
"""Half-lengths of the rectangle about the trunk that the published height scan covers, along x and y [m] [ViNL
config]."""

SCAN_SPACING = 0.1
"""Of the points along x and y [m] [ViNL config]."""

SCAN_OFFSET = 0.5
"""The scan reads trunk height minus this minus ground height, held to +-1 m [ViNL code]."""

_PROPRIOCEPTION = (
    ObservationTerm("base_linear_velocity", 3, (2.0,), 0.1, "m/s"),
    ObservationTerm("base_angular_velocity", 3, (0.25,), 0.2, "rad/s"),
    ObservationTerm("projected_gravity", 3, (1.0,), 0.05, "1"),
    ObservationTerm("command", 3, (2.0, 2.0, 0.25), 0.0, "m/s, m/s, rad/s"),
    ObservationTerm("joint_position", 12, (1.0,), 0.01, "rad"),
    ObservationTerm("joint_velocity", 12, (0.05,), 1.5, "rad/s"),
    ObservationTerm("previous_action", 12, (1.0,), 0.0, "1"),
)

CLIP = 100.0
"""Observations are held to +- this [ViNL config]."""


@dataclass(frozen=True)
class ObservationTable:
    """What a policy observes: rows of numbers, one behind the other."""

    terms: tuple[ObservationTerm, ...]

    def __iter__(self) -> Iterator[ObservationTerm]:
        return iter(self.terms)

    @cached_property
    def size(self) -> int:
        """Numbers of the whole observation."""
        return sum(term.size for term in self.terms)

    @cached_property
    def scale(self) -> np.ndarray:
        """(size,) factor of every number."""
        return self._per_number([term.scale for term in self.terms])

    @cached_property
    def noise(self) -> np.ndarray:
        """(size,) half-width of the training noise of every number, after scaling."""
        return self.scale * self._per_number([(term.noise,) for term in self.terms])

    def place(self, name: str) -> slice:
        """Where the numbers of a row are. Raises ``KeyError`` if no row has this name."""
        first = 0
        for term in self.terms:
            if term.name == name:
                return slice(first, first + term.size)
            first += term.size
        raise KeyError(name)

    def describe(self) -> list[dict[str, Any]]:
        """The table as plain data, for policy cards and the docs."""
        return [
            {"name": t.name, "size": t.size, "scale": list(t.scale), "noise": t.noise, "unit": t.unit}
            for t in self.terms
        ]

    def _per_number(self, values: list[tuple[float, ...]]) -> np.ndarray:
        parts = [np.broadcast_to(v, term.size) for v, term in zip(values, self.terms, strict=True)]
        return np.concatenate(parts).astype(np.float32)


_LINES = [np.arange(-n, n + 1) * SCAN_SPACING for n in (round(reach / SCAN_SPACING) for reach in SCAN_REACH)]
SCAN_POINTS = np.stack(np.meshgrid(*_LINES, indexing="ij"), -1).reshape(-1, 2)
"""(187, 2) points about the trunk at which the ground is read, in the heading frame [m], x outer, y inner."""

SCAN_RADIUS = float(np.linalg.norm(SCAN_REACH))
"""How far the farthest of them lies from the middle of the trunk [m]."""

PROPRIOCEPTION = ObservationTable(_PROPRIOCEPTION)
"""What a robot knows of itself: the first rows of what locomotors observe."""

HEIGHT_SCAN = ObservationTerm("height_scan", len(SCAN_POINTS), (5.0,), 0.1, "m")

TABLE = ObservationTable((*_PROPRIOCEPTION, HEIGHT_SCAN))
"""The same and the ground, which critics and agents of environments may know; scales and training noise of legged_gym
[ViNL config]."""

PROPRIOCEPTION_SIZE, SCAN_SIZE = PROPRIOCEPTION.size, HEIGHT_SCAN.size


def observe(xp: Any, qpos: Any, qvel: Any, command: Any, previous_action: Any, ground: Any = None) -> Any:
    """The observation of every robot without noise, (n, 235) in the order of ``TABLE``, or without ground (n, 48) in
    that of ``PROPRIOCEPTION``; for numpy and jax.numpy (``xp``). Raises ``ValueError`` if there is another number of
    points.

    Args:
        qpos: (n, 19) trunk position [m] and quaternion, joint angles [rad].
        qvel: (n, 18) trunk velocity in the world [m/s], angular velocity in the body [rad/s], joint speeds [rad/s]
            (MuJoCo's convention for a free joint).
        command: (n, 3) forward [m/s], left [m/s], yaw rate [rad/s].
        previous_action: (n, 12) the network's last output.
        ground: (n, 187) height of the ground under ``SCAN_POINTS`` [m], as ``scan_ground`` reads it; None:
            proprioception alone.
    """
    if ground is not None and ground.shape[-1] != SCAN_SIZE:
        raise ValueError(f"the height scan has {SCAN_SIZE} points, got {ground.shape[-1]}")
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
    ]
    if ground is not None:
        parts.append(xp.clip(qpos[:, 2:3] - SCAN_OFFSET - ground, -1.0, 1.0))
    scale = (PROPRIOCEPTION if ground is None else TABLE).scale
    return xp.clip(xp.concatenate(parts, -1) * xp.asarray(scale, dtype=qpos.dtype), -CLIP, CLIP)
