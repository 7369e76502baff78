"""Walls as lines with openings, rooms as outlines, turned into boxes and cells."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Bool, Float

from vinl.config.errors import InputError
from vinl.world.boxes import Boxes
from vinl.world.floorplan import frame_around
from vinl.world.grid import GridFrame

Point = tuple[float, float]

ON_LINE = 0.05
"""Two walls on parallel lines nearer than this [m] are one wall seen from its two sides."""


@dataclass(frozen=True)
class Wall:
    """A straight wall. Ends and thickness in metres, ``height`` above the floor."""

    start: Point
    end: Point
    thickness: float
    height: float

    def __post_init__(self) -> None:
        _check_finite("wall", *self.start, *self.end, self.thickness, self.height)


@dataclass(frozen=True)
class Opening:
    """A doorway: a stretch of a wall's middle line that is open from the floor up to ``height`` [m]."""

    start: Point
    end: Point
    height: float

    def __post_init__(self) -> None:
        _check_finite("opening", *self.start, *self.end, self.height)


def read_point(entry: Any) -> Point:
    """Two numbers [m]."""
    x, y = entry
    return float(x), float(y)


def _check_finite(what: str, *numbers: float) -> None:
    if not all(map(math.isfinite, numbers)):
        raise InputError(f"a {what} has a number that is not finite")


def box_along(
    start: Point, end: Point, thickness: float, bottom: float, top: float, beyond: float = 0.0
) -> list[float]:
    """A row of ``Boxes`` along a line [m], which goes on ``beyond`` both ends."""
    (x0, y0), (x1, y1) = start, end
    yaw, length = np.arctan2(y1 - y0, x1 - x0), np.hypot(x1 - x0, y1 - y0) + 2 * beyond
    return [float(v) for v in ((x0 + x1) / 2, (y0 + y1) / 2, yaw, length, thickness, bottom, top)]


def raise_walls(walls: list[Wall], openings: list[Opening]) -> np.ndarray:
    """Rows of boxes (see ``Boxes``), shape (n, 7): what is left of each wall beside its openings, and the lintels.

    An opening is cut out of every wall that runs along the same line, so of both twins of a wall between two rooms.
    Twins that say the same twice give one box.
    """
    rows: list[list[float]] = []
    for wall in walls:
        start, end = np.array(wall.start), np.array(wall.end)
        length = float(np.linalg.norm(end - start))
        if length < 1e-6:
            continue
        along = (end - start) / length
        across = np.array([-along[1], along[0]])
        # one direction for both twins, so that equal boxes are equal rows
        yaw = float(np.arctan2(along[1], along[0])) % np.pi
        yaw = 0.0 if np.pi - yaw < 1e-9 else yaw
        cuts = []
        for opening in openings:
            ends = np.array([opening.start, opening.end]) - start
            if np.abs(ends @ across).max() > max(ON_LINE, wall.thickness / 2):
                continue
            low, high = np.clip(np.sort(ends @ along), 0.0, length)
            if high - low > 1e-6:
                cuts.append((float(low), float(high), opening.height))
        pieces = [(low, high, 0.0) for low, high in _subtract(length, cuts)]
        # a stretch that ends at the wall's own end also fills the corner with the next wall
        grown = [
            (
                low - (wall.thickness / 2 if low < 1e-6 else 0.0),
                high + (wall.thickness / 2 if high > length - 1e-6 else 0),
                b,
            )
            for low, high, b in pieces
        ]
        grown += [(low, high, top) for low, high, top in cuts if wall.height - top > 0.01]
        for low, high, bottom in grown:
            x, y = start + along * (low + high) / 2
            rows.append([float(x), float(y), yaw, high - low, wall.thickness, bottom, wall.height])
    table = Boxes(np.array(rows).reshape(-1, 7)).rows  # which refuses what is no box
    _, first = np.unique(np.round(table, 3), axis=0, return_index=True)
    return table[np.sort(first)]


def _subtract(length: float, cuts: list[tuple[float, float, float]]) -> list[tuple[float, float]]:
    """What is left of the stretch from 0 to ``length``."""
    left, at = [], 0.0
    for low, high, _ in sorted(cuts):
        if low - at > 1e-3:
            left.append((at, low))
        at = max(at, high)
    if length - at > 1e-3:
        left.append((at, length))
    return left


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
    """The grid around rooms and walls, and which of its cells lie in a room. Raises ``InputError`` if a coordinate is
    not finite."""
    every = np.concatenate([*polygons, *[np.array([w.start, w.end]) for w in walls]])
    if not np.isfinite(every).all():
        raise InputError(f"{source}: a wall or a room has a coordinate that is not a number")
    frame = frame_around(every.min(0), every.max(0), source)
    inside = np.zeros(frame.shape, dtype=bool)
    for polygon in polygons:
        inside |= paint_polygon(polygon, frame)
    return frame, inside
