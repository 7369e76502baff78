"""Gaps that look as if a robot fitted through: a chest or a box in the way, where there is another way around."""

from __future__ import annotations

import math
from collections.abc import Callable
from random import Random

import numpy as np
from jaxtyping import Bool, Float
from scipy.ndimage import distance_transform_edt

from vinl.world.boxes import Boxes
from vinl.world.floorplan import measure_clearance
from vinl.world.free_space import distance_field, read_field
from vinl.world.grid import GridFrame
from vinl.world.homes.walls import Row
from vinl.world.raster import label_regions, paint_boxes

GAP = (0.1, 0.5)
"""Width that is left [m]: the robot is 0.31 m wide, and walks through 0.54 m at ease."""

PASSAGE = (0.6, 2.0)
"""Width of the passages that are narrowed [m]."""

DEPTH, HEIGHT = (0.2, 1.2), (0.3, 1.6)
"""Of what stands in the way, along the passage and above the floor [m]."""

UPRIGHT = 0.3
"""A box that is turned by less than this stands upright to the walls [rad]."""

TRIES = 12
"""Places tried for each."""

SPECK = 0.1
"""Smaller parts of the floor about a gap do not count [m2]."""

AROUND = 1.5
"""The floor within this of a gap falls apart with it [m]."""

DETOUR = 4.0
"""The way around a gap is at least as long [m]."""


def narrow_passages(
    rng: Random,
    free: Bool[np.ndarray, "rows columns"],
    frame: GridFrame,
    count: int,
    radius: float,
    connected: Callable[[Bool[np.ndarray, "rows columns"]], bool],
) -> list[Row]:
    """Boxes at one side of a passage that leave a gap at its other side.

    Args:
        free: floor without anything in the robot's way.
        radius: of the robot [m].
        connected: whether a robot still comes everywhere on such a floor.
    """
    rows: list[Row] = []
    passages = _Passages(free, frame)
    for _ in range(TRIES * count):
        if len(rows) == count:
            break
        row = passages.draw(rng)
        if row is None:
            continue
        left = passages.free & ~paint_boxes(Boxes(np.array([row])), frame)
        parts = [_part(floor, frame, row, radius) for floor in (passages.free, left)]
        if len(parts[1]) <= len(parts[0]) or not connected(left):
            continue
        field = distance_field(measure_clearance(left, frame.resolution) >= radius, frame, parts[1][0])
        if read_field(field, frame, parts[1][1]) >= DETOUR:
            rows.append(row)
            passages = _Passages(left, frame)
    return rows


class _Passages:
    """Where the floor is as narrow as a passage."""

    def __init__(self, free: Bool[np.ndarray, "rows columns"], frame: GridFrame) -> None:
        self.free, self._frame = free, frame
        self._steps, self._nearest = distance_transform_edt(free, return_indices=True)  # type: ignore[misc]
        low, high = (width / 2 / frame.resolution for width in PASSAGE)
        self._cells = np.argwhere((self._steps >= low) & (self._steps <= high))

    def draw(self, rng: Random) -> Row | None:
        """A box at one side of a passage; None where the place that was tried is none."""
        if not len(self._cells):
            return None
        cell, half = tuple(self._cells[rng.randrange(len(self._cells))]), 0.5 * self._frame.resolution
        wall = self._nearest[:, *cell]
        angle = math.atan2(*(np.array(cell) - wall))
        quarter = round(angle / (math.pi / 2)) * math.pi / 2
        if abs(angle - quarter) < UPRIGHT:
            angle = quarter
        across = np.array([math.cos(angle), math.sin(angle)])
        near = self._frame.xy(wall) + half * across
        far = np.arange(0.0, PASSAGE[1], half)
        line = self._frame.cell(near + (far[:, None] + half) * across)
        beyond = far[~self.free[line[:, 0], line[:, 1]]]
        if not len(beyond) or beyond[0] < PASSAGE[0]:
            return None
        length = beyond[0] - rng.uniform(*GAP)
        middle = length / 2 if rng.random() < 0.5 else beyond[0] - length / 2
        x, y = near + middle * across
        return x, y, angle, length, rng.uniform(*DEPTH), 0.0, rng.uniform(*HEIGHT)


def _part(
    free: Bool[np.ndarray, "rows columns"], frame: GridFrame, row: Row, radius: float
) -> Float[np.ndarray, "parts 2"]:
    """The parts that the floor about a box falls into for the robot: a point of each, the largest first [m]."""
    reach = AROUND + radius
    low, high = (frame.cell(np.array(row[:2]) + sign * reach) for sign in (-1, 1))
    cut = free[low[0] : high[0] + 1, low[1] : high[1] + 1]
    parts = label_regions(measure_clearance(cut, frame.resolution) >= radius)
    sizes = np.bincount(parts.ravel(), minlength=1)[1:]
    found = [k for k in np.argsort(-sizes) if sizes[k] * frame.resolution**2 >= SPECK]
    cells = np.array([np.argwhere(parts == k + 1)[0] for k in found], dtype=int).reshape(-1, 2)
    return frame.xy(low + cells)
