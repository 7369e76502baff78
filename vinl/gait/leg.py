"""One leg in its own plane: where the shank lies over a foothold. For numpy, jax.numpy and torch alike (``xp``)."""

from __future__ import annotations

from typing import Any

from vinl.robot.aliengo import LINK

LONGEST = 0.488
"""Longest leg that the calf's limit allows, from thigh joint to foot [m]; 0.5 would be a straight one."""

REACH = 0.48
"""Longest way from hip to foot that a foothold may ask for [m]."""

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
