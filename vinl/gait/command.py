"""The command that a robot walks by: blocks are crossed quickly, walls are not run into. For numpy, jax.numpy and torch
alike (``xp``)."""

from __future__ import annotations

from itertools import pairwise
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

GRAZING_SPEED = 0.2
"""Largest forward speed where a wall is right before the trunk [m/s]: at 0.8 m/s it is pushed and feet run up it. A
robot that stood still would never slide past what it only grazes."""


def _grid(ahead: tuple[float, float, float], aside: tuple[float, float]) -> np.ndarray:
    """(rows, places, 2): rows across the way from the hindmost to the foremost, places to both sides; pitches [m]."""
    x, y = np.arange(ahead[0], ahead[1] + 0.01, ahead[2]), np.arange(-aside[0], aside[0] + 0.01, aside[1])
    return np.stack(np.meshgrid(x, y, indexing="ij"), -1).astype(np.float32)


UNDER = _grid((-0.45, 0.95, 0.1), (0.2, 0.1))
"""(15, 5, 2) where a block counts [m], from the rear feet to the front feet's next footholds and 0.2 m farther, in
which a robot gains speed: one that lies all across a row, 0.4 m. Smaller ones, as toys and shoes are, lie between the
feet or beside them, and are touched more often in a hurry."""

AHEAD = _grid((0.35, 0.95, 0.1), (0.2, 0.1))
"""(7, 5, 2) where a wall forbids to go faster [m]."""

NOSE = _grid((0.36, 0.41, 0.05), (0.14, 0.07))
"""(2, 5, 2) where a wall slows a robot down [m]: 3 to 9 cm before the trunk, which ends 0.325 m ahead of its middle,
and nearly as wide."""

_ASKED = (UNDER, SOLID), (UNDER, WALL), (AHEAD, WALL), (NOSE, WALL)
_POINTS = np.concatenate([np.insert(xy.reshape(-1, 2), 2, z, 1) for xy, z in _ASKED]).astype(np.float32)
"""(195, 3) all that is asked of the map, above the floor: in one go, for a robot's computer is slow to begin each."""

_ENDS = np.cumsum([0, *(xy[..., 0].size for xy, _ in _ASKED)]).tolist()


def adapt_command(xp: Any, config: GaitConfig, view: GroundView | None, command: Any, feet: Any) -> Any:
    """(n, 3) the command that robots walk by: over a block across the way at ``CROSSING_SPEED`` at least, unless a wall
    is ahead, and before a wall at ``GRAZING_SPEED`` at most.

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
    low, high, ahead, nose = (inside[:, first:end] for first, end in pairwise(_ENDS))
    over = (low & ~high).reshape(-1, *UNDER.shape[:2]).all(-1).any(-1)
    wall = ahead.any(-1)
    hurries = over & ~wall & (forward > LEAST) & (forward < CROSSING_SPEED)
    forward = xp.where(hurries, 0 * forward + CROSSING_SPEED, forward)
    forward = xp.where(nose.any(-1), xp.clip(forward, None, GRAZING_SPEED), forward)
    return xp.concatenate([forward[:, None], command[:, 1:]], -1)
