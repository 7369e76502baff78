"""What the locomotor observes: one table, and the function that fills it, for numpy and jax.numpy alike."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from vinl.robot.aliengo import DEFAULT_POSE
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


SCAN_X = np.arange(-8, 9) * 0.1
SCAN_Y = np.arange(-5, 6) * 0.1
SCAN_POINTS = np.stack(np.meshgrid(SCAN_X, SCAN_Y, indexing="ij"), -1).reshape(-1, 2)
"""The 187 points of the height scan in the heading frame [m], x outer, y inner [ViNL config]."""

SCAN_OFFSET = 0.5
"""The scan reads trunk height minus this minus ground height, held to +-1 m [ViNL code]."""

TABLE = (
    ObservationTerm("base_linear_velocity", 3, (2.0,), 0.1, "m/s"),
    ObservationTerm("base_angular_velocity", 3, (0.25,), 0.2, "rad/s"),
    ObservationTerm("projected_gravity", 3, (1.0,), 0.05, "1"),
    ObservationTerm("command", 3, (2.0, 2.0, 0.25), 0.0, "m/s, m/s, rad/s"),
    ObservationTerm("joint_position", 12, (1.0,), 0.01, "rad"),
    ObservationTerm("joint_velocity", 12, (0.05,), 1.5, "rad/s"),
    ObservationTerm("previous_action", 12, (1.0,), 0.0, "1"),
    ObservationTerm("height_scan", 187, (5.0,), 0.1, "m"),
)
"""The 235 numbers in their order, with scales and training noise of legged_gym [ViNL config]."""

PROPRIOCEPTION_SIZE = sum(term.size for term in TABLE[:-1])
SCAN_SIZE = TABLE[-1].size
OBSERVATION_SIZE = PROPRIOCEPTION_SIZE + SCAN_SIZE
CLIP = 100.0
"""Observations are held to +- this [ViNL config]."""


def _per_number(values: list[tuple[float, ...]]) -> np.ndarray:
    return np.concatenate([np.broadcast_to(v, term.size) for v, term in zip(values, TABLE, strict=True)]).astype(
        np.float32
    )


SCALE = _per_number([term.scale for term in TABLE])
"""(235,) factor of every number."""

NOISE = SCALE * _per_number([(term.noise,) for term in TABLE])
"""(235,) half-width of the training noise of every number, after scaling."""


def observe(xp: Any, qpos: Any, qvel: Any, command: Any, previous_action: Any, ground: Any) -> Any:
    """The observation of every robot, without noise.

    Args:
        xp: ``numpy`` or ``jax.numpy``.
        qpos: (n, 19) trunk position [m] and quaternion, joint angles [rad].
        qvel: (n, 18) trunk velocity in the world [m/s], angular velocity in the body [rad/s], joint speeds [rad/s]
            (MuJoCo's convention for a free joint).
        command: (n, 3) forward [m/s], left [m/s], yaw rate [rad/s].
        previous_action: (n, 12) the network's last output.
        ground: (n, 187) height of the ground under the scan points [m].

    Returns:
        (n, 235) in the order of ``TABLE``.
    """
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
        xp.clip(qpos[:, 2:3] - SCAN_OFFSET - ground, -1.0, 1.0),
    ]
    return xp.clip(xp.concatenate(parts, -1) * xp.asarray(SCALE, dtype=qpos.dtype), -CLIP, CLIP)


def describe() -> list[dict[str, Any]]:
    """The table as plain data, for policy cards and the docs."""
    return [{"name": t.name, "size": t.size, "scale": list(t.scale), "noise": t.noise, "unit": t.unit} for t in TABLE]
