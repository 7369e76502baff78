"""A small height map about the robot, in its heading frame: what a network predicts in place of a map of the world.

For numpy, jax.numpy and torch (``xp``). The planner reads it as it reads the world.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from vinl.gait.arrays import take_along, to_index
from vinl.gait.ground_view import CREST_RADIUS
from vinl.robot.aliengo import FOOT_RADIUS

CELL = 0.05
"""Side of a cell [m]: that of the ground's cells in training."""

REACH = (-0.65, 1.25), (-0.45, 0.45)
"""What the map covers, along and across [m]: from behind the rear feet's footholds to the front feet's next but one."""

X, Y = (np.arange(round(low / CELL), round(high / CELL) + 1) * CELL for low, high in REACH)
POINTS = np.stack(np.meshgrid(X, Y, indexing="ij"), -1).reshape(-1, 2)
"""(741, 2) middles of the cells in the heading frame [m], x outer, y inner."""

SHAPE = (len(X), len(Y))

SOLID = 0.025
"""What rises so far above the floor under the robot is an obstacle [m]."""

WALL = 0.28
"""What rises so far above the floor is a wall [m]: to keep off, and no ground to step over or onto, as in
``build_ground_map``. Blocks that these legs cross are lower; of a wall the camera shows what lies below itself."""

_FAR = 0.25
"""Distances from obstacles are held to at most this [m]."""

_TOP_CELLS = 3
"""An obstacle's height counts as far as this from it [cells]: farther points are not near it in any case."""


def floor_under(xp: Any, feet: Any) -> Any:
    """(n,) height of the floor under robots whose feet (n, 4, 3) these are: that of the lowest foot [m].

    Which feet stand by the clock is not enough to tell: for a moment none may, and one that is late is still in the
    air, or stands on a block."""
    return xp.amin(feet[..., 2], -1) - FOOT_RADIUS


class LocalMapView:
    """A ``GroundView`` of predicted heights.

    Args:
        xp: ``numpy``, ``jax.numpy`` or ``torch``.
        heights: (n, 741) of the ground at ``POINTS``, above the floor [m].
        floor: (n,) height of the floor under the robot in the heading frame [m].
    """

    def __init__(self, xp: Any, heights: Any, floor: Any) -> None:
        self._xp, self._floor = xp, floor
        grid = heights.reshape(-1, *SHAPE)
        ground = xp.where(grid > WALL, 0 * grid, grid)
        self._heights = ground.reshape(len(heights), -1)
        reach = round(CREST_RADIUS / CELL)
        disc = [(i, j) for i in range(-reach, reach + 1) for j in range(-reach, reach + 1) if np.hypot(i, j) <= reach]
        self._crest = self._highest(ground, disc).reshape(len(heights), -1)
        distance, self._top = (x.reshape(len(heights), -1) for x in self._obstacles(grid))
        # of a cell and those beyond it, beside one another: what lies between them is read at once
        beyond, last = (0, 1, SHAPE[1], SHAPE[1] + 1), distance.shape[1] - SHAPE[1] - 1
        self._corners = xp.stack([distance[:, k : k + last] for k in beyond], -1)

    def clearance(self, points: Any) -> Any:
        """See ``GroundView``."""
        xp = self._xp
        i, j = self._cells(points)
        i0, j0 = xp.floor(i), xp.floor(j)
        i0, j0 = xp.clip(i0, 0, SHAPE[0] - 2), xp.clip(j0, 0, SHAPE[1] - 2)
        a, b = i - i0, j - j0
        index = to_index(xp, i0 * SHAPE[1] + j0).reshape(len(points), -1, 1)
        corners = take_along(xp, self._corners, index, 1).reshape(*i.shape, 4)
        beside = (1 - a) * ((1 - b) * corners[..., 0] + b * corners[..., 1])
        beside = beside + a * ((1 - b) * corners[..., 2] + b * corners[..., 3])
        top = self._read(self._top, xp.round(i) * SHAPE[1] + xp.round(j))
        above = points[..., 2] - self._over(points) - top
        outside = xp.hypot(xp.clip(beside, 0, None), xp.clip(above, 0, None))
        return outside + xp.clip(xp.maximum(beside, above), None, 0)

    def height(self, xy: Any) -> Any:
        """See ``GroundView``."""
        return self._read_nearest(self._heights, xy)

    def crest(self, xy: Any) -> Any:
        """See ``GroundView``."""
        return self._read_nearest(self._crest, xy)

    def _over(self, points: Any) -> Any:
        return self._floor.reshape(-1, *(1,) * (points.ndim - 2))

    def _cells(self, xy: Any) -> tuple[Any, Any]:
        xp = self._xp
        i = xp.clip((xy[..., 0] - float(X[0])) / CELL, 0, SHAPE[0] - 1)
        return i, xp.clip((xy[..., 1] - float(Y[0])) / CELL, 0, SHAPE[1] - 1)

    def _read_nearest(self, grid: Any, xy: Any) -> Any:
        i, j = self._cells(xy)
        found = self._read(grid, self._xp.round(i) * SHAPE[1] + self._xp.round(j))
        return found + self._over(xy)

    def _read(self, grid: Any, index: Any) -> Any:
        flat = to_index(self._xp, index).reshape(len(grid), -1)
        return take_along(self._xp, grid, flat, 1).reshape(index.shape)

    def _shifted(self, grid: Any, offsets: list[tuple[int, int]], outside: float) -> Iterator[Any]:
        """The grid seen from so many cells (i, j) farther back, for each of the offsets."""
        wide = grid
        far = [max(abs(offset[axis]) for offset in offsets) for axis in (0, 1)]
        for axis, reach in enumerate(far, 1):
            if reach:
                edge = 0 * (wide[:, :reach] if axis == 1 else wide[:, :, :reach]) + outside
                wide = self._xp.concatenate([edge, wide, edge], axis)
        for i, j in offsets:
            yield wide[:, far[0] + i :][:, : SHAPE[0], far[1] + j : far[1] + j + SHAPE[1]]

    def _highest(self, grid: Any, offsets: list[tuple[int, int]]) -> Any:
        best = grid
        for shifted in self._shifted(grid, offsets, -1.0):
            best = self._xp.maximum(best, shifted)
        return best

    def _obstacles(self, grid: Any) -> tuple[Any, Any]:
        """(n, rows, columns) distance from the edge of the nearest obstacle, negative inside, and its height [m]."""
        xp, reach = self._xp, round(_FAR / CELL)
        solid = grid > SOLID
        nothing, far = 0 * grid, 0 * grid + 9.0
        # from the nearest obstacle and to the nearest floor, in one go
        square = xp.concatenate([xp.where(solid, nothing, far), xp.where(solid, far, nothing)], 0)
        for axis in (0, 1):  # exact squared distances to cells, one axis after the other
            best, steps = square, [step for step in range(-reach, reach + 1) if step]
            offsets = [(step, 0) if axis == 0 else (0, step) for step in steps]
            for step, moved in zip(steps, self._shifted(square, offsets, 9.0), strict=True):
                best = xp.minimum(best, moved + (step * CELL) ** 2)
            square = best
        outside, inside = xp.sqrt(square[: len(grid)]), xp.sqrt(square[len(grid) :])
        distance = xp.clip(outside - inside - xp.where(solid, nothing - CELL / 2, nothing + CELL / 2), -_FAR, _FAR)
        top = xp.where(solid, grid, nothing)
        for axis in (0, 1):
            spread = [(k, 0) if axis == 0 else (0, k) for k in range(-_TOP_CELLS, _TOP_CELLS + 1) if k]
            top = self._highest(top, spread)
        return distance, top
