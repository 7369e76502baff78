"""Feet and motion from what a robot measures of itself: joint angles, gravity and velocities of the trunk.

For numpy, jax.numpy and torch alike (``xp``).
"""

from __future__ import annotations

from typing import Any

import numpy as np

from vinl.gait.arrays import constant
from vinl.robot.aliengo import CONTROL_DT, HIPS, LINK, THIGH_ASIDE

ROLLING_RADIUS = 0.0225
"""How far above the point that it rolls about the middle of a foot moves [m]: its radius, less what it is pressed in
[what takes out the bias of standing feet in MuJoCo C]. Shanks swing through a stance, and feet roll with them: 6 % of
the trunk's speed."""


def feet_in_trunk(xp: Any, joints: Any) -> Any:
    """(n, 4, 3) middles of the feet in the trunk's frame [m], from joint angles (n, 12) [rad]."""
    hip, thigh, calf = (joints[:, k::3] for k in range(3))
    below = -LINK * (xp.cos(thigh) + xp.cos(thigh + calf))
    ahead = -LINK * (xp.sin(thigh) + xp.sin(thigh + calf))
    aside = constant(xp, THIGH_ASIDE.astype(np.float32), joints)
    c, s = xp.cos(hip), xp.sin(hip)
    at_hips = constant(xp, HIPS.astype(np.float32), joints)
    return xp.stack([ahead, c * aside - s * below, s * aside + c * below], -1) + at_hips


def velocities_by_feet(xp: Any, feet: Any, joints: Any, speeds: Any, gravity: Any, turning: Any) -> Any:
    """(n, 4, 3) how fast the trunk moves in its own frame, if each foot rolls on the ground and does not slip [m/s].

    Args:
        xp: ``numpy``, ``jax.numpy`` or ``torch``.
        feet: (n, 4, 3) of ``feet_in_trunk`` [m].
        joints: (n, 12) angles [rad].
        speeds: (n, 12) of the joints [rad/s].
        gravity: (n, 3) its direction in the trunk's frame.
        turning: (n, 3) angular velocity of the trunk, in its frame [rad/s].
    """
    moved = (feet_in_trunk(xp, joints - CONTROL_DT * speeds) - feet) / CONTROL_DT
    turned, up = (xp.broadcast_to(x[:, None], feet.shape) for x in (turning, -gravity))
    hip, bend = speeds[:, 0::3], speeds[:, 1::3] + speeds[:, 2::3]
    c, s = xp.cos(joints[:, 0::3]), xp.sin(joints[:, 0::3])
    shank = turned + xp.stack([hip, c * bend, s * bend], -1)
    return moved - xp.linalg.cross(turned, feet) + xp.linalg.cross(shank, ROLLING_RADIUS * up)


def heading_axes(xp: Any, gravity: Any) -> Any:
    """(n, 3, 3) rows: the axes of the heading frame in the trunk's frame.

    Args:
        xp: ``numpy``, ``jax.numpy`` or ``torch``.
        gravity: (n, 3) direction of gravity in the trunk's frame; noise may have changed its length.
    """
    up = -gravity / xp.clip(xp.sqrt((gravity**2).sum(-1)), 1e-6, None)[:, None]
    # the trunk's x axis without its part along the vertical
    ahead = xp.stack([1.0 - up[:, 0] ** 2, -up[:, 0] * up[:, 1], -up[:, 0] * up[:, 2]], -1)
    ahead = ahead / xp.clip(xp.sqrt((ahead**2).sum(-1)), 1e-6, None)[:, None]
    left = xp.stack(
        [
            up[:, 1] * ahead[:, 2] - up[:, 2] * ahead[:, 1],
            up[:, 2] * ahead[:, 0] - up[:, 0] * ahead[:, 2],
            up[:, 0] * ahead[:, 1] - up[:, 1] * ahead[:, 0],
        ],
        -1,
    )
    return xp.stack([ahead, left, up], 1)


def into_heading_frame(axes: Any, vectors: Any) -> Any:
    """Vectors of the trunk's frame (n, ..., 3) in the heading frame with axes (n, 3, 3)."""
    shaped = axes.reshape(len(axes), *(1,) * (vectors.ndim - 2), 3, 3)
    return (shaped * vectors[..., None, :]).sum(-1)


def motion_of(xp: Any, axes: Any, velocity: Any, turning: Any) -> Any:
    """(n, 4) how the trunk moves in a control step, as ``state.tick`` wants it.

    Args:
        xp: ``numpy``, ``jax.numpy`` or ``torch``.
        axes: of the heading frame, as ``heading_axes`` gives them.
        velocity: (n, 3) of the trunk, in its frame [m/s].
        turning: (n, 3) its angular velocity, in its frame [rad/s].
    """
    along = into_heading_frame(axes, velocity)
    return xp.concatenate([along, into_heading_frame(axes, turning)[:, 2:]], -1) * CONTROL_DT
