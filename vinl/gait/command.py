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


def _grid(ahead: tuple[float, float, float], aside: tuple[float, float]) -> np.ndarray:
    """Places from the nearest to the farthest and from the right to the left of the middle, so far apart [m]."""
    x, y = np.arange(ahead[0], ahead[1] + 0.01, ahead[2]), np.arange(-aside[0], aside[0] + 0.01, aside[1])
    return np.stack(np.meshgrid(x, y, indexing="ij"), -1).reshape(-1, 2).astype(np.float32)


UNDER = _grid((-0.45, 0.75, 0.1), (0.2, 0.1))
"""(65, 2) where a block counts [m]: from the rear feet to the front feet's next footholds."""

AHEAD = _grid((0.35, 0.95, 0.1), (0.2, 0.1))
"""(35, 2) where a wall forbids to go faster [m]."""


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
    low, high = (_clearance(xp, view, UNDER, floor + z) for z in (SOLID, WALL))
    over = ((low < 0) & (high >= 0)).any(-1)
    wall = (_clearance(xp, view, AHEAD, floor + WALL) < 0).any(-1)
    hurries = over & ~wall & (forward > LEAST) & (forward < CROSSING_SPEED)
    forward = xp.where(hurries, 0 * forward + CROSSING_SPEED, forward)
    return xp.concatenate([forward[:, None], command[:, 1:]], -1)


def _clearance(xp: Any, view: GroundView, places: np.ndarray, z: Any) -> Any:
    """(n, k) at k places and heights (n,) in the heading frame [m]."""
    xy = constant(xp, places, z) + 0 * z[:, None, None]
    return view.clearance(xp.concatenate([xy, z[:, None, None] + 0 * xy[..., :1]], -1))
