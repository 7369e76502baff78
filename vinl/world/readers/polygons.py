"""Rooms given by their outline."""

from __future__ import annotations

import numpy as np
import shapely
from jaxtyping import Bool, Float
from shapely.ops import polylabel

from vinl.world.grid import GridFrame


def paint_polygon(polygon: Float[np.ndarray, "k 2"], frame: GridFrame) -> Bool[np.ndarray, "rows columns"]:
    """The cells whose centre lies in the outline [m]."""
    x, y = frame.centres()
    shape = shapely.make_valid(shapely.Polygon(polygon))
    shapely.prepare(shape)
    return shapely.contains_xy(shape, *np.meshgrid(x, y))


def place_label(polygon: Float[np.ndarray, "k 2"]) -> tuple[float, float]:
    """A point well inside the outline [m]: the middle of the largest circle in it."""
    shape = shapely.Polygon(polygon)
    point = polylabel(shape, 0.1) if shape.is_valid and shape.area > 0 else shape.centroid
    return float(point.x), float(point.y)
