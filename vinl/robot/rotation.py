"""Rotations by unit quaternions w, x, y, z, for numpy and jax.numpy alike: ``xp`` is the array module."""

from __future__ import annotations

import math
from typing import Any

import numpy as np


def rotate_inverse(xp: Any, quaternion: Any, vector: Any) -> Any:
    """World vectors (..., 3) in the body frame, whose unit quaternions (..., 4) are body to world."""
    w, r = quaternion[..., :1], -quaternion[..., 1:]
    t = 2 * _cross(xp, r, vector)
    return vector + w * t + _cross(xp, r, t)


def _cross(xp: Any, a: Any, b: Any) -> Any:
    """``xp.cross``, for numpy written out: its own takes several times as long for a few robots."""
    if xp is not np:
        return xp.cross(a, b)
    ax, ay, az = (a[..., k] for k in range(3))
    bx, by, bz = (b[..., k] for k in range(3))
    return xp.stack([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx], -1)


def wrap_angle(angle: Any) -> Any:
    """The same angle [rad] within half a turn of zero, for arrays of any kind."""
    return (angle + math.pi) % (2 * math.pi) - math.pi


def yaw_of(xp: Any, quaternion: Any) -> Any:
    """Heading [rad] of unit quaternions (..., 4): the angle of the body's x axis seen from above."""
    w, x, y, z = (quaternion[..., k] for k in range(4))
    return xp.arctan2(2 * (w * z + x * y), 1 - 2 * (y**2 + z**2))


def matrix_of(xp: Any, quaternion: Any) -> Any:
    """Rotation matrices (..., 3, 3), body to world, of unit quaternions (..., 4)."""
    w, x, y, z = (quaternion[..., k] for k in range(4))
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return xp.stack([xp.stack(row, -1) for row in rows], -2)
