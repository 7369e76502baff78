"""Kinematics of the legs: where a shank lies over a foothold, which joint angles bring a foot somewhere, and how it
moves with them. For numpy, jax.numpy and torch alike (``xp``)."""

from __future__ import annotations

from typing import Any

import numpy as np

from vinl.gait.arrays import constant
from vinl.robot.aliengo import HIPS, LINK, THIGH_ASIDE

SHORTEST, LONGEST = 0.12, 0.488
"""Lengths of a leg that joint angles are given for, from thigh joint to foot [m]; the calf's limits are just beyond."""

REACH = 0.48
"""Longest way from hip to foot that a foothold may ask for [m]; 0.5 is a straight leg, 0.488 the calf's limit."""

SHANK_FRACTIONS = (0.35, 0.65, 1.0)
"""Places along the shank that are held against blocks, from the foot (0) to the knee (1)."""


def knee_from_foot(xp: Any, ahead: Any, hip: Any) -> tuple[Any, Any]:
    """Where the knee is, seen from the foot; knees point back.

    Args:
        xp: ``numpy``, ``jax.numpy`` or ``torch``.
        ahead: how far the foot is ahead of the hip [m], any shape.
        hip: height of the hip above the middle of the foot [m], of a shape that fits.

    Returns:
        Forward and up from the foot [m], both of the joint shape. A hip out of reach counts as just in reach.
    """
    length = xp.clip(xp.sqrt(ahead**2 + hip**2), 1e-3, 1.999 * LINK)
    bulge = xp.sqrt(LINK**2 - length**2 / 4) / length
    return -ahead / 2 - hip * bulge, hip / 2 - ahead * bulge


def farthest(xp: Any, hip: Any) -> Any:
    """How far from below the hip a foot can stand within ``REACH`` [m], for hips at heights ``hip`` above it [m]."""
    return xp.sqrt(xp.clip(REACH**2 - hip**2, 1e-6, None))


def leg_angles(xp: Any, feet: Any) -> Any:
    """Joint angles that bring feet to places; those out of reach are neared along the leg.

    Args:
        xp: ``numpy``, ``jax.numpy`` or ``torch``.
        feet: (n, 4, 3) middles of the feet in the trunk's frame [m].

    Returns:
        (n, 12) [rad], knees back, in the order of ``JOINTS``.
    """
    x, y, z = (feet[..., k] - constant(xp, HIPS[:, k].astype(np.float32), feet) for k in range(3))
    aside = constant(xp, THIGH_ASIDE.astype(np.float32), feet)
    below = xp.sqrt(xp.clip(y**2 + z**2 - aside**2, 1e-4, None))
    hip = xp.arctan2(z * aside + y * below, y * aside - z * below)
    length = xp.clip(xp.sqrt(x**2 + below**2), SHORTEST, LONGEST)
    calf = -2 * xp.arccos(length / (2 * LINK))
    return xp.stack([hip, xp.arctan2(-x, below) - calf / 2, calf], -1).reshape(len(feet), 12)


def leg_jacobian(xp: Any, joints: Any) -> Any:
    """(n, 4, 3, 3) how feet move in the trunk's frame (rows) with their joints (columns) [m/rad], at angles (n, 12)."""
    hip, thigh, calf = (joints[:, k::3] for k in range(3))
    below, ahead = -LINK * (xp.cos(thigh) + xp.cos(thigh + calf)), -LINK * xp.cos(thigh + calf)
    by_thigh, by_calf = LINK * (xp.sin(thigh) + xp.sin(thigh + calf)), LINK * xp.sin(thigh + calf)
    aside = constant(xp, THIGH_ASIDE.astype(np.float32), joints)
    c, s = xp.cos(hip), xp.sin(hip)
    rows = [
        [0 * below, below, ahead],
        [-s * aside - c * below, -s * by_thigh, -s * by_calf],
        [c * aside - s * below, c * by_thigh, c * by_calf],
    ]
    return xp.stack([xp.stack(row, -1) for row in rows], -2)
