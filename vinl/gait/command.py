"""The command that a robot walks by: blocks are crossed quickly. For numpy, jax.numpy and torch alike (``xp``)."""

from __future__ import annotations

from typing import Any

import numpy as np

from vinl.gait.arrays import constant
from vinl.gait.config import GaitConfig
from vinl.gait.ground_view import GroundView
from vinl.gait.local_map import SOLID, WALL, floor_under

CROSSING_SPEED = 0.5
"""Least forward speed over blocks [m/s]: the slower a robot, the shorter its strides, and one of 0.27 m, which is that
of 0.3 m/s, has no room for a bar 0.2 m deep."""

LEAST = 0.1
"""Commands below this are not raised [m/s]: the robot is to stand, or to turn on the spot."""


def _grid(first: float, last: float) -> np.ndarray:
    """Places 0.1 m apart, from behind to ahead and 0.2 m to both sides [m]."""
    x, y = np.arange(first, last + 0.01, 0.1), np.arange(-0.2, 0.21, 0.1)
    return np.stack(np.meshgrid(x, y, indexing="ij"), -1).reshape(-1, 2).astype(np.float32)


UNDER = _grid(-0.45, 0.75)
"""(65, 2) where a block counts [m]: from the rear feet to the front feet's next footholds."""

AHEAD = _grid(0.35, 0.95)
"""(35, 2) where a wall forbids to go faster [m]."""

_POINTS = np.concatenate([np.insert(xy, 2, z, 1) for xy, z in ((UNDER, SOLID), (UNDER, WALL), (AHEAD, WALL))]).astype(
    np.float32
)
"""(165, 3) all that is asked of the map, above the floor: in one go, for a robot's computer is slow to begin each."""

_PARTS = slice(0, len(UNDER)), slice(len(UNDER), 2 * len(UNDER)), slice(2 * len(UNDER), None)


def adapt_command(xp: Any, config: GaitConfig, view: GroundView | None, command: Any, feet: Any) -> Any:
    """(n, 3) the command that robots walk by: over blocks at ``CROSSING_SPEED`` at least, unless a wall is ahead.

    A wall is what stands higher than ``WALL`` over the floor, furniture too.

    Args:
        xp: ``numpy``, ``jax.numpy`` or ``torch``.
        config: of the gait; without ``map`` nothing is known of blocks.
        view: the ground; None: level, and nothing on it.
        command: (n, 3) forward, left [m/s], yaw rate [rad/s].
        feet: (n, 4, 3) middles of the feet in the heading frame [m].
    """
    if view is None or not config.map:
        return command
    floor, forward = floor_under(xp, feet), command[:, 0]
    points = constant(xp, _POINTS, command) + 0 * command[:, None, :1]
    inside = view.clearance(xp.concatenate([points[..., :2], points[..., 2:] + floor[:, None, None]], -1)) < 0
    low, high, ahead = (inside[:, part] for part in _PARTS)
    over, wall = (low & ~high).any(-1), ahead.any(-1)
    hurries = over & ~wall & (forward > LEAST) & (forward < CROSSING_SPEED)
    forward = xp.where(hurries, 0 * forward + CROSSING_SPEED, forward)
    return xp.concatenate([forward[:, None], command[:, 1:]], -1)
