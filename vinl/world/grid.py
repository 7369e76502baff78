"""Where the cells of a grid lie, height fields with labels, and how far points are from blocks on such a grid.
Rows run along y, columns along x, the origin is the lower left cell."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float, Int, UInt8

from vinl.config.errors import InputError
from vinl.world.boxes import Boxes


@dataclass(frozen=True)
class GridFrame:
    """The frame of a regular grid of (rows, columns), rows along y, columns along x, in the world: the centre of cell
    [0, 0] and the side of a cell [m]."""

    x0: float
    y0: float
    resolution: float
    shape: tuple[int, int]

    def cell(self, xy: Float[np.ndarray, "*n 2"]) -> Int[np.ndarray, "*n 2"]:
        """The cells (row, column) that hold the points, held to the grid's edge."""
        xy = np.asarray(xy)
        j = np.rint((xy[..., 0] - self.x0) / self.resolution)
        i = np.rint((xy[..., 1] - self.y0) / self.resolution)
        return np.stack([np.clip(i, 0, self.shape[0] - 1), np.clip(j, 0, self.shape[1] - 1)], -1).astype(np.int64)

    def xy(self, cell: Int[np.ndarray, "*n 2"]) -> Float[np.ndarray, "*n 2"]:
        """World positions [m] of the centres of the cells (row, column)."""
        cell = np.asarray(cell)
        return np.stack([self.x0 + cell[..., 1] * self.resolution, self.y0 + cell[..., 0] * self.resolution], -1)

    def centres(self) -> tuple[Float[np.ndarray, " columns"], Float[np.ndarray, " rows"]]:
        """x of every column and y of every row [m]."""
        return (
            self.x0 + np.arange(self.shape[1]) * self.resolution,
            self.y0 + np.arange(self.shape[0]) * self.resolution,
        )

    def widen(self, cells: int) -> GridFrame:
        """The same grid with so many more cells on each side."""
        rows, columns = self.shape
        rim = cells * self.resolution
        return GridFrame(self.x0 - rim, self.y0 - rim, self.resolution, (rows + 2 * cells, columns + 2 * cells))


GROUND, BLOCK, WALL = 0, 1, 2
"""Labels of the cells, in order of precedence."""


@dataclass(frozen=True, eq=False)
class HeightField:
    """Heights [m] and labels (``GROUND``, ``BLOCK`` or ``WALL``) of the vertices of one grid. Raises ``InputError`` if
    the shapes differ or a height is not finite."""

    heights: Float[np.ndarray, "rows columns"]
    labels: UInt8[np.ndarray, "rows columns"]
    frame: GridFrame

    def __post_init__(self) -> None:
        if self.heights.shape != self.frame.shape or self.labels.shape != self.frame.shape:
            raise InputError(
                f"height field: shapes of heights {self.heights.shape}, labels {self.labels.shape} and frame "
                f"{self.frame.shape} differ"
            )
        if not np.isfinite(self.heights).all():
            raise InputError("height field holds a height that is not finite")


def flat_field(frame: GridFrame) -> HeightField:
    """Level ground at z = 0."""
    return HeightField(np.zeros(frame.shape, np.float32), np.zeros(frame.shape, np.uint8), frame)


def raise_boxes(field: HeightField, boxes: Boxes, label: int) -> None:
    """Write boxes into a height field in place, with the label ``BLOCK`` or ``WALL``: every vertex inside a footprint
    rises to the box's top. Where several boxes stand, the highest top wins, and so does the highest label."""
    for top, near, beyond in _look_around(field.frame, boxes, field.frame.resolution):
        inside, heights, labels = beyond.max(-1) <= 1e-9, field.heights[near], field.labels[near]
        heights[inside] = np.maximum(heights[inside], top)
        labels[inside] = np.maximum(labels[inside], label)


def _look_around(
    frame: GridFrame, boxes: Boxes, margin: float
) -> Iterator[tuple[float, tuple[slice, slice], np.ndarray]]:
    """For every box its top [m], the cells within a margin [m] of it, and how far these lie beyond its sides [m]."""
    xs, ys = frame.centres()
    reach = np.hypot(boxes.rows[:, 3], boxes.rows[:, 4]) / 2 + margin
    for row, r in zip(boxes.rows, reach, strict=True):
        j = slice(*np.searchsorted(xs, [row[0] - r, row[0] + r]))
        i = slice(*np.searchsorted(ys, [row[1] - r, row[1] + r]))
        points = np.stack(np.meshgrid(xs[j], ys[i]), -1)
        yield row[6], (i, j), Boxes(row[None]).beyond(points.reshape(-1, 2)).reshape(points.shape)


FAR = 0.25
"""Distances are held to at most this [m]."""


def block_distances(
    frame: GridFrame, boxes: Boxes
) -> tuple[Float[np.ndarray, "rows columns"], Float[np.ndarray, "rows columns"]]:
    """Signed distance of every vertex of the grid to the edge of the nearest footprint, negative inside, at most
    ``FAR`` [m], and the box's top [m] (0 where none is near)."""
    distance, top = np.full(frame.shape, FAR, np.float32), np.zeros(frame.shape, np.float32)
    for high, near, beyond in _look_around(frame, boxes, FAR):
        d = np.hypot(*np.moveaxis(np.maximum(beyond, 0), -1, 0)) + np.minimum(beyond.max(-1), 0)
        nearer = d < distance[near]
        distance[near] = np.where(nearer, d, distance[near])
        top[near] = np.where(nearer, high, top[near])
    return distance, top


def clearance(xp: Any, distance: Any, top: Any, frame: GridFrame, points: Any) -> Any:
    """Distance of points (..., 3) [m] from the nearest block, negative inside it, for numpy and jax.numpy (``xp``);
    exact to about 3 mm along edges and 1 cm at corners, on a grid of 5 cm. ``distance`` and ``top`` are those of
    ``block_distances``, flattened."""
    rows, columns = frame.shape
    c = xp.clip((points[..., 0] - frame.x0) / frame.resolution, 0, columns - 1.001)
    r = xp.clip((points[..., 1] - frame.y0) / frame.resolution, 0, rows - 1.001)
    j, i = xp.floor(c), xp.floor(r)
    a, b = r - i, c - j
    corner = (i * columns + j).astype("int32")
    beside = (1 - a) * ((1 - b) * distance[corner] + b * distance[corner + 1])
    beside = beside + a * ((1 - b) * distance[corner + columns] + b * distance[corner + columns + 1])
    above = points[..., 2] - top[(xp.round(r) * columns + xp.round(c)).astype("int32")]
    outside = xp.hypot(xp.maximum(beside, 0), xp.maximum(above, 0))
    return outside + xp.minimum(xp.maximum(beside, above), 0)
