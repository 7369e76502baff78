"""Height fields with labels: ground that MJX collides with, scans and meshes, and that knows what each cell is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, UInt8

from vinl.config.errors import InputError
from vinl.world.boxes import Boxes
from vinl.world.grid import GridFrame

GROUND, BLOCK, WALL = 0, 1, 2
"""Labels of the cells, in order of precedence."""


@dataclass(frozen=True, eq=False)
class HeightField:
    """Heights and labels on one grid.

    Attributes:
        heights: (rows, columns) height of every vertex [m].
        labels: (rows, columns) ``GROUND``, ``BLOCK`` or ``WALL``.
        frame: where the vertices lie.

    Raises:
        InputError: if the shapes differ or a height is not finite.
    """

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
    """Write boxes into a height field in place: every vertex inside a footprint rises to the box's top.

    Boxes that stand on another are not told apart: the higher top wins, and so does the higher label.

    Args:
        field: changed in place.
        boxes: what to write.
        label: ``BLOCK`` or ``WALL``.
    """
    xs, ys = field.frame.centres()
    reach = np.hypot(boxes.rows[:, 3], boxes.rows[:, 4]) / 2 + field.frame.resolution
    for row, r in zip(boxes.rows, reach, strict=True):
        j = slice(*np.searchsorted(xs, [row[0] - r, row[0] + r]))
        i = slice(*np.searchsorted(ys, [row[1] - r, row[1] + r]))
        grid = np.stack(np.meshgrid(xs[j], ys[i]), -1)
        inside = Boxes(row[None]).contain(grid.reshape(-1, 2)).reshape(grid.shape[:2])
        heights, labels = field.heights[i, j], field.labels[i, j]
        heights[inside] = np.maximum(heights[inside], row[6])
        labels[inside] = np.maximum(labels[inside], label)
