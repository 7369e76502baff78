"""Which floor is inside a building that is known by its walls only, even where the outer walls have gaps."""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool
from scipy.ndimage import distance_transform_edt

from vinl.world.raster import label_regions

GAPS = (1.3, 2.2)
"""Openings in the outer walls up to these widths [m] do not let the outside in: a front door, then a double one. The
wider measure counts only for rooms that are wider than the opening, so that a niche outside stays outside."""

POCKET = 2.0
"""What is cut off from the outside by the rounding of a corner and holds less floor than this [m2] is outside."""


def find_inside(walls: Bool[np.ndarray, "rows columns"], resolution: float) -> Bool[np.ndarray, "rows columns"]:
    """The floor that walls enclose.

    The outside is where a disc as wide as a door can roll to from the edge of the grid without touching a wall: it
    cannot roll through a door. What it cannot cover is inside, except for the corners that are too narrow for it.

    Args:
        walls: true where a wall stands; the grid's edge is outside.
        resolution: side of a cell [m].

    Returns:
        True on enclosed floor, false on walls and outside.
    """
    walls = np.pad(walls, int(GAPS[-1] / resolution) + 2)
    away = np.asarray(distance_transform_edt(~walls)) * resolution
    inside, _ = _enclose(walls, away, GAPS[0] / 2, resolution)
    for gap in GAPS[1:]:
        wider, cores = _enclose(walls, away, gap / 2, resolution)
        rooms = label_regions(wider & ~inside)
        kept = np.unique(rooms[cores & (rooms > 0)])
        inside |= np.isin(rooms, kept[kept > 0])
    cut = int(GAPS[-1] / resolution) + 2
    return inside[cut:-cut, cut:-cut]


def _enclose(walls: np.ndarray, away: np.ndarray, radius: float, resolution: float) -> tuple[np.ndarray, np.ndarray]:
    """What a disc of this radius that comes from outside cannot cover, and where within it the disc itself fits."""
    fits = away > radius
    places = label_regions(fits)
    outer = fits & (places == places[0, 0])
    reach = np.asarray(distance_transform_edt(~outer)) * resolution
    outside = reach <= radius
    cores = fits & ~outer
    inside = ~walls & ~outside
    rooms = label_regions(inside)
    area = np.bincount(rooms.ravel()) * resolution**2
    touches = np.zeros(len(area), dtype=bool)
    # rooms that touch the outside and neither hold the disc nor much floor are corners of the outside
    beside = np.zeros_like(walls)
    beside[1:] |= outside[:-1]
    beside[:-1] |= outside[1:]
    beside[:, 1:] |= outside[:, :-1]
    beside[:, :-1] |= outside[:, 1:]
    touches[np.unique(rooms[beside])] = True
    holds = np.zeros(len(area), dtype=bool)
    holds[np.unique(rooms[cores])] = True
    keep = ~touches | holds | (area >= POCKET)
    keep[0] = False
    return keep[rooms], cores & inside
