"""What the planner reads of the ground: distances from blocks and heights, about every robot, from one grid."""

from __future__ import annotations

from typing import Any, NamedTuple, Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float
from scipy import ndimage

from vinl.robot.rotation import yaw_of
from vinl.world.boxes import Boxes
from vinl.world.grid import GridFrame, block_distances, clearance

CREST_RADIUS = 0.10
"""The highest ground within this distance counts for a swing path [m]: as far as a foot rises or falls beside it."""


@runtime_checkable
class GroundView(Protocol):
    """The ground about n robots, in their heading frames."""

    def clearance(self, points: Any) -> Any:
        """Distances of points (n, ..., 3) from the nearest block or wall [m], negative inside."""
        ...

    def height(self, xy: Any) -> Any:
        """Height of the ground, blocks included, under points (n, ..., 2) [m]."""
        ...

    def crest(self, xy: Any) -> Any:
        """Height of the highest ground or block within ``CREST_RADIUS`` of points (n, ..., 2) [m]."""
        ...


class GroundMap(NamedTuple):
    """Grids that a planner reads, flattened; arrays of numpy or jax.

    Attributes:
        heights: (cells,) of ground and blocks [m].
        crest: (cells,) the highest of them within ``CREST_RADIUS`` [m].
        distance, top: (cells,) as ``world.clearance.block_distances`` gives them [m].
    """

    heights: Any
    crest: Any
    distance: Any
    top: Any


def build_ground_map(heights: Float[np.ndarray, "rows columns"], frame: GridFrame, boxes: Boxes) -> GroundMap:
    """The grids of a piece of ground.

    Args:
        heights: of ground and blocks, without walls [m].
        boxes: everything that feet must stay off: blocks, walls, furniture.
    """
    distance, top = block_distances(frame, boxes)
    reach = int(CREST_RADIUS / frame.resolution + 1e-6)
    side = np.arange(-reach, reach + 1)
    disc = np.hypot(*np.meshgrid(side, side)) <= reach
    crest = ndimage.maximum_filter(heights, footprint=disc)
    return GroundMap(*(x.astype(np.float32).reshape(-1) for x in (heights, crest, distance, top)))


class FieldView:
    """A map of the world seen from robots whose poses are known. For numpy and jax.numpy.

    Args:
        xp: ``numpy`` or ``jax.numpy``.
        qpos: (n, >= 7) position [m] and quaternion of the trunks.
    """

    def __init__(self, xp: Any, ground: GroundMap, frame: GridFrame, qpos: Any) -> None:
        self._xp, self._ground, self._frame = xp, ground, frame
        yaw = yaw_of(xp, qpos[:, 3:7])
        self._place, self._cos, self._sin = qpos[:, :3], xp.cos(yaw), xp.sin(yaw)

    def clearance(self, points: Any) -> Any:
        """See ``GroundView``."""
        xp, like = self._xp, (-1, *(1,) * (points.ndim - 2))
        x, y = self._world(points)
        world = xp.stack([x, y, points[..., 2] + self._place[:, 2].reshape(like)], -1)
        return clearance(xp, self._ground.distance, self._ground.top, self._frame, world)

    def height(self, xy: Any) -> Any:
        """See ``GroundView``."""
        return self._read(self._ground.heights, xy)

    def crest(self, xy: Any) -> Any:
        """See ``GroundView``."""
        return self._read(self._ground.crest, xy)

    def _world(self, xy: Any) -> tuple[Any, Any]:
        like = (-1, *(1,) * (xy.ndim - 2))
        c, s = self._cos.reshape(like), self._sin.reshape(like)
        x, y = (self._place[:, k].reshape(like) for k in range(2))
        return x + c * xy[..., 0] - s * xy[..., 1], y + s * xy[..., 0] + c * xy[..., 1]

    def _read(self, grid: Any, xy: Any) -> Any:
        xp, frame = self._xp, self._frame
        rows, columns = frame.shape
        x, y = self._world(xy)
        # held to the grid while still floating point: a robot thrown far away must not overflow the integer
        column = xp.clip(xp.rint((x - frame.x0) / frame.resolution), 0, columns - 1).astype("int32")
        row = xp.clip(xp.rint((y - frame.y0) / frame.resolution), 0, rows - 1).astype("int32")
        found = xp.take(grid, row * columns + column, mode="clip")
        return found - self._place[:, 2].reshape((-1, *(1,) * (xy.ndim - 2)))
