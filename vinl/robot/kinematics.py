"""Where the feet are, from the joint angles alone, for numpy and jax.numpy alike: ``xp`` is the array module."""

from __future__ import annotations

from typing import Any

import numpy as np

from vinl.robot.aliengo import LEGS
from vinl.robot.rotation import matrix_of

_FRONT = np.array([1.0 if leg[0] == "F" else -1.0 for leg in LEGS])
_LEFT = np.array([1.0 if leg[1] == "L" else -1.0 for leg in LEGS])
HIPS = np.stack([0.2407 * _FRONT, 0.051 * _LEFT, 0.0 * _LEFT], 1)
"""(4, 3) hip joints in the trunk's frame [m] [aliengo.xml]."""

THIGH_ASIDE = 0.0868 * _LEFT
"""(4,) how far the thigh joint lies aside of the hip joint [m] [aliengo.xml]."""

LINK = 0.25
"""Length of a thigh and of a shank [m] [aliengo.xml]."""


def foot_positions(xp: Any, qpos: Any) -> Any:
    """Middles of the feet.

    Args:
        xp: ``numpy`` or ``jax.numpy``.
        qpos: (n, 19) trunk position [m] and unit quaternion w x y z, joint angles [rad].

    Returns:
        (n, 4, 3) in the world [m], in the order of ``LEGS``.
    """
    return _leg_points(xp, qpos, 1.0)


def knee_positions(xp: Any, qpos: Any) -> Any:
    """(n, 4, 3) the knees in the world [m]; arguments as for ``foot_positions``."""
    return _leg_points(xp, qpos, 0.0)


def _leg_points(xp: Any, qpos: Any, down: float) -> Any:
    """Points along the shanks, from the knee (0) to the foot (1)."""
    hip, thigh, calf = (qpos[:, 7 + k :: 3] for k in range(3))
    below = -LINK * (xp.cos(thigh) + down * xp.cos(thigh + calf))
    ahead = -LINK * (xp.sin(thigh) + down * xp.sin(thigh + calf))
    aside = xp.asarray(THIGH_ASIDE, dtype=qpos.dtype)
    c, s = xp.cos(hip), xp.sin(hip)
    in_trunk = xp.stack([ahead, c * aside - s * below, s * aside + c * below], -1) + xp.asarray(HIPS, dtype=qpos.dtype)
    turned = (matrix_of(xp, qpos[:, 3:7])[:, None] * in_trunk[:, :, None, :]).sum(-1)
    return turned + qpos[:, None, :3]
