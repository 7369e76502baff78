"""Rooms given by their outline."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from jaxtyping import Bool, Float

from vinl.config.errors import InputError
from vinl.world.floorplan import frame_around
from vinl.world.grid import GridFrame
from vinl.world.readers.segments import Wall


def paint_polygon(polygon: Float[np.ndarray, "k 2"], frame: GridFrame) -> Bool[np.ndarray, "rows columns"]:
    """The cells whose centre lies in the outline [m]."""
    import shapely  # only here: generated homes do without

    x, y = frame.centres()
    shape = shapely.make_valid(shapely.Polygon(polygon))
    shapely.prepare(shape)
    return shapely.contains_xy(shape, *np.meshgrid(x, y))


def place_label(polygon: Float[np.ndarray, "k 2"]) -> tuple[float, float]:
    """A point well inside the outline [m]: the middle of the largest circle in it."""
    import shapely
    from shapely.ops import polylabel

    shape = shapely.Polygon(polygon)
    with np.errstate(divide="ignore", invalid="ignore"):  # of slivers
        point = polylabel(shape, 0.1) if shape.is_valid and shape.area > 0 else shape.centroid
    return float(point.x), float(point.y)


def paint_inside(
    polygons: Sequence[Float[np.ndarray, "_ 2"]], walls: Iterable[Wall], source: str
) -> tuple[GridFrame, Bool[np.ndarray, "rows columns"]]:
    """The grid around rooms and walls, and which of its cells lie in a room.

    Raises:
        InputError: a coordinate is not finite.
    """
    every = np.concatenate([*polygons, *[np.array([w.start, w.end]) for w in walls]])
    if not np.isfinite(every).all():
        raise InputError(f"{source}: a wall or a room has a coordinate that is not a number")
    frame = frame_around(every.min(0), every.max(0), source)
    inside = np.zeros(frame.shape, dtype=bool)
    for polygon in polygons:
        inside |= paint_polygon(polygon, frame)
    return frame, inside
