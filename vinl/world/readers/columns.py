"""What stands above each cell of a plan's grid, out of triangles: from which height to which."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float
from scipy.ndimage import binary_closing, maximum

from vinl.world.boxes import Boxes
from vinl.world.floorplan import BODY_HEIGHT, measure_clearance
from vinl.world.grid import GridFrame
from vinl.world.raster import label_regions, split_rectangles

STEP = 0.08
"""What rises less than this above the floor is walked over [m]: rugs, thresholds, noise of a scan."""

SLICE = 0.1
"""Height of the layers that the space above the floor is cut into [m]."""

WALL_FROM = 1.7
"""What begins near the floor and reaches this height is a wall [m]."""

OVERHEAD = 2.2
"""What begins above this height is left out [m]: ceilings, lamps."""

FLAT = 0.12
"""Surface within this of the floor's height is floor [m]."""

NICHE = 1.5
"""Floor shut in by walls or furniture with less than this is not floor but the inside of a thing [m2]."""

NARROW = 0.2
"""What is shut in and nowhere has this distance to its sides is the inside of a wall or a chest [m]."""

_CHUNK = 2_000_000


@dataclass(frozen=True, eq=False)
class Columns:
    """What stands on each cell of a grid.

    Attributes:
        frame: where the cells lie.
        layers: (layers, rows, columns), whether there is surface in each layer of ``SLICE`` above ``STEP``.
        floor: (rows, columns) cells with floor.
        wall_height: top of the walls [m].
    """

    frame: GridFrame
    layers: Bool[np.ndarray, "layers rows columns"]
    floor: Bool[np.ndarray, "rows columns"]
    wall_height: float

    @property
    def low(self) -> Bool[np.ndarray, "rows columns"]:
        """Cells with something in the robot's way."""
        return np.logical_or.reduce(self.layers[: _layer(BODY_HEIGHT)])

    @property
    def tall(self) -> Bool[np.ndarray, "rows columns"]:
        """Cells under walls: surface in most layers from the floor up to ``WALL_FROM``."""
        fraction: np.ndarray = self.layers[: _layer(WALL_FROM)].mean(0)  # type: ignore[assignment]
        return fraction >= 0.8

    def boxes(self) -> tuple[Boxes, Boxes]:
        """Walls and furniture as boxes that cover the cells exactly; what they shut in and is too small to stand in
        belongs to them."""
        tall = _close(self.tall)
        solid = tall | self.low
        niches = label_regions(~solid)
        count = int(niches.max()) + 1
        small = np.bincount(niches.ravel()) * self.frame.resolution**2 < NICHE
        small |= maximum(measure_clearance(~solid, self.frame.resolution), niches, np.arange(count)) < NARROW
        small[0] = False
        # between the two faces of a wall there is wall, inside a chest there is furniture
        around = [np.bincount(grid.ravel(), minlength=count) for grid in _neighbours(niches, tall)]
        walled = small & (around[1] > 0.8 * np.maximum(around[0], 1))
        hollow = walled[niches]
        filled = (small & ~walled)[niches]
        walls = [self._raise(tall | hollow, 0.0, self.wall_height)]
        rows = [self._raise(filled, 0.0, 1.0)]
        for bottom, top, cells in self._runs(~(tall | hollow)):
            lintel = bottom >= BODY_HEIGHT and top >= self.wall_height - 2 * SLICE
            (walls if lintel else rows).append(self._raise(cells & ~filled, bottom, top))
        return Boxes(np.concatenate(walls)), Boxes(np.concatenate(rows))

    def _runs(self, kept: np.ndarray) -> Iterator[tuple[float, float, np.ndarray]]:
        """Bottom, top and cells of the stretches of layers with surface, those of equal bottom and top together."""
        layers = self.layers & kept
        count = len(layers)
        empty = np.zeros_like(layers[:1])
        begins = layers & ~np.concatenate([empty, layers[:-1]])
        for first in range(min(count, _layer(OVERHEAD))):
            alive = begins[first]
            for last in range(first, count):
                if not alive.any():
                    break
                ends = alive & ~(layers[last + 1] if last + 1 < count else empty[0])
                if ends.any():
                    bottom = 0.0 if first == 0 else STEP + first * SLICE
                    yield bottom, STEP + (last + 1) * SLICE, ends
                alive = alive & ~ends

    def _raise(self, cells: np.ndarray, bottom: float, top: float) -> np.ndarray:
        found = split_rectangles(cells)
        low, high = found[:, [1, 0]] - 0.5, found[:, [3, 2]] - 0.5
        origin, pitch = np.array([self.frame.x0, self.frame.y0]), self.frame.resolution
        middle, size = origin + (low + high) / 2 * pitch, (high - low) * pitch
        n = len(found)
        return np.column_stack([middle, np.zeros(n), size, np.full(n, bottom), np.full(n, top)])


def find_columns(triangles: Float[np.ndarray, "f 3 3"], frame: GridFrame, wall_height: float) -> Columns:
    """Sort the surface of triangles, sampled every half cell, into cells and layers.

    Args:
        triangles: with the floor at z = 0 [m].
        frame: of the grid.
        wall_height: surface above it is left out [m].
    """
    count = max(_layer(wall_height), _layer(WALL_FROM))
    layers = np.zeros((count, *frame.shape), bool)
    floor = np.zeros(frame.shape, bool)
    highest = min(wall_height, float(triangles[..., 2].max()))
    triangles = triangles[(triangles[..., 2].max(1) > -FLAT) & (triangles[..., 2].min(1) < wall_height)]
    for points in _sample(triangles, frame.resolution / 2):
        z = points[:, 2]
        cell = frame.cell(points[:, :2])
        flat = np.abs(z) <= FLAT
        floor[cell[flat, 0], cell[flat, 1]] = True
        layer = np.floor((z - STEP) / SLICE).astype(int)
        held = (z >= STEP) & (layer < count)
        layers[layer[held], cell[held, 0], cell[held, 1]] = True
    return Columns(frame, layers, binary_closing(np.pad(floor, 3), iterations=2)[3:-3, 3:-3], highest)


def _sample(triangles: Float[np.ndarray, "f 3 3"], spacing: float) -> Iterator[Float[np.ndarray, "n 3"]]:
    """Points on triangles, no farther apart than ``spacing`` [m], corners included."""
    longest = np.linalg.norm(triangles - np.roll(triangles, 1, axis=1), axis=2).max(1)
    parts = np.maximum(np.ceil(longest / spacing), 1).astype(int)
    # few sizes of lattice: the next power of sqrt(2)
    parts = np.ceil(np.sqrt(2.0) ** np.ceil(np.log2(parts) * 2)).astype(int)
    for n in np.unique(parts):
        i, j = np.meshgrid(np.arange(n + 1), np.arange(n + 1), indexing="ij")
        i, j = i[i + j <= n], j[i + j <= n]
        weights = np.column_stack([i, j, n - i - j]) / n
        group = triangles[parts == n]
        batch = max(_CHUNK // len(weights), 1)
        for k in range(0, len(group), batch):
            for at in range(0, len(weights), _CHUNK):
                yield np.einsum("wk,fkd->fwd", weights[at : at + _CHUNK], group[k : k + batch]).reshape(-1, 3)


def _close(mask: np.ndarray) -> np.ndarray:
    """The mask without holes and cracks of one or two cells."""
    closed: np.ndarray = binary_closing(np.pad(mask, 2), np.ones((3, 3), bool))  # type: ignore[assignment]
    return closed[2:-2, 2:-2]


def _neighbours(niches: np.ndarray, tall: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Numbers of the niches once for each of their cells' neighbours that are not in one, and for those under walls."""
    n = np.pad(niches, 1)
    t = np.pad(tall, 1)
    shifts = [(0, 1), (0, -1), (1, 0), (-1, 0)]
    edges = [np.where((n > 0) & (np.roll(n, shift, (0, 1)) == 0), n, 0) for shift in shifts]
    walled = [np.where(np.roll(t, shift, (0, 1)), edge, 0) for shift, edge in zip(shifts, edges, strict=True)]
    return np.stack(edges), np.stack(walled)


def _layer(height: float) -> int:
    """Number of layers up to a height [m]."""
    return round((height - STEP) / SLICE)
