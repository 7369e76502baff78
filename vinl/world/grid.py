"""Where the cells of a grid lie. Rows run along y, columns along x, the origin is the lower left cell."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int


@dataclass(frozen=True)
class GridFrame:
    """The frame of a regular grid in the world.

    Attributes:
        x0, y0: world position of the centre of cell [0, 0] [m].
        resolution: side of a cell [m].
        shape: (rows, columns), rows along y, columns along x.
    """

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
