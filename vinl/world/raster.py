"""Between pixels and boxes: rectangles out of a mask, boxes painted on a grid, specks dropped; and which floor walls
enclose, even where the outer ones have gaps."""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Int
from scipy.ndimage import binary_dilation, distance_transform_edt, label

from vinl.config.errors import InputError
from vinl.world.boxes import Boxes
from vinl.world.grid import GridFrame


def label_regions(mask: Bool[np.ndarray, "rows columns"], corners: bool = False) -> Int[np.ndarray, "rows columns"]:
    """Number of each cell's connected region, from 1 on in the order of their first cells; 0 off the mask. Cells join
    over edges, with ``corners`` also over these."""
    regions, _ = label(mask, np.ones((3, 3), bool) if corners else None)  # type: ignore[misc]
    return regions


def find_largest(regions: Int[np.ndarray, "rows columns"]) -> Bool[np.ndarray, "rows columns"]:
    """The cells of the region with most of them; none where there is none."""
    sizes = np.bincount(regions.ravel())
    sizes[0] = 0
    return (regions == sizes.argmax()) & (regions > 0)


def split_rectangles(mask: Bool[np.ndarray, "rows columns"], limit: int = 20_000) -> Int[np.ndarray, "n 4"]:
    """Few rectangles that together cover exactly the true cells of the mask: first row, first column, one past the last
    row, one past the last column. Greedy: the first cell not yet covered (row by row) grows into the larger of two
    rectangles, widest first or tallest first. Rectangles may overlap, which saves boxes where walls cross.

    Raises ``InputError`` if more than ``limit`` are needed: such a mask is noise, and no simulator takes it.
    """
    todo = mask.copy()
    rectangles = []
    for r in range(mask.shape[0]):
        while True:
            open_cells = np.flatnonzero(todo[r])
            if not len(open_cells):
                break
            c = int(open_cells[0])
            grown = [_grow(mask, r, c), _grow(mask.T, c, r)]
            grown[1] = (grown[1][1], grown[1][0], grown[1][3], grown[1][2])
            best = max(grown, key=lambda q: int(todo[q[0] : q[2], q[1] : q[3]].sum()))
            rectangles.append(best)
            if len(rectangles) > limit:
                raise InputError(f"the walls fall into more than {limit} boxes; drop noise with --min-speck")
            todo[best[0] : best[2], best[1] : best[3]] = False
    return np.array(rectangles, dtype=np.int64).reshape(-1, 4)


def _grow(mask: np.ndarray, r: int, c: int) -> tuple[int, int, int, int]:
    """From one cell: as far as the mask goes along the row, then as many whole rows as it goes."""
    row = mask[r]
    gaps_before, gaps_after = np.flatnonzero(~row[:c]), np.flatnonzero(~row[c:])
    left = int(gaps_before[-1]) + 1 if len(gaps_before) else 0
    right = c + int(gaps_after[0]) if len(gaps_after) else mask.shape[1]
    first, last = r, r + 1
    while first > 0 and mask[first - 1, left:right].all():
        first -= 1
    while last < mask.shape[0] and mask[last, left:right].all():
        last += 1
    return first, left, last, right


def drop_specks(mask: Bool[np.ndarray, "rows columns"], min_speck: int) -> Bool[np.ndarray, "rows columns"]:
    """The mask without its pieces (joined over edges and corners) of fewer than ``min_speck`` cells."""
    if min_speck <= 1:
        return mask
    pieces = label_regions(mask, corners=True)
    sizes = np.bincount(pieces.ravel())
    sizes[0] = 0
    return (sizes >= min_speck)[pieces]


def paint_boxes(boxes: Boxes, frame: GridFrame) -> Bool[np.ndarray, "rows columns"]:
    """The cells whose centre a box's footprint holds; a box thinner than a cell is painted one cell wide, so that no
    wall falls through the grid."""
    grid = np.zeros(frame.shape, dtype=bool)
    for rows, columns, held in find_cells(boxes, frame):
        grid[rows, columns] |= held
    return grid


def find_cells(boxes: Boxes, frame: GridFrame) -> list[tuple[slice, slice, np.ndarray | bool]]:
    """For every box, what ``paint_boxes`` paints: a range of rows, one of columns, and which cells of these; ``True``
    is all of them."""
    if not len(boxes):
        return []
    table = boxes.rows.copy()
    turned = np.abs(np.sin(2 * table[:, 2])) > 1e-6
    least = frame.resolution * np.where(turned, np.sqrt(2), 1.0)
    table[:, 3], table[:, 4] = np.maximum(table[:, 3], least), np.maximum(table[:, 4], least)
    cosine, sine = np.cos(table[:, 2]), np.sin(table[:, 2])
    cosine[~turned], sine[~turned] = np.rint(cosine[~turned]), np.rint(sine[~turned])
    across, along = np.abs(cosine), np.abs(sine)
    reach = np.column_stack([across * table[:, 3] + along * table[:, 4], along * table[:, 3] + across * table[:, 4]])
    x, y = frame.centres()
    bounds = [
        np.searchsorted(line, table[:, k] + sign * (reach[:, k] / 2 + 1e-9), side)  # type: ignore[call-overload]
        for k, line in ((1, y), (0, x))
        for sign, side in ((-1, "left"), (1, "right"))
    ]
    found: list[tuple[slice, slice, np.ndarray | bool]] = []
    entries = zip(*(column.tolist() for column in (*bounds, turned, *table.T[[0, 1, 3, 4]], cosine, sine)), strict=True)
    for r0, r1, c0, c1, askew, x0, y0, length, width, c, s in entries:
        held: np.ndarray | bool = True
        if askew:
            dx, dy = x[None, c0:c1] - x0, y[r0:r1, None] - y0
            held = (np.abs(c * dx + s * dy) <= length / 2 + 1e-9) & (np.abs(c * dy - s * dx) <= width / 2 + 1e-9)
        found.append((slice(r0, r1), slice(c0, c1), held))
    return found


GAPS = (1.3, 2.2)
"""Openings in the outer walls up to these widths [m] do not let the outside in: a front door, then a double one. The
wider measure counts only for rooms that are wider than the opening, so that a niche outside stays outside."""

POCKET = 2.0
"""What is cut off from the outside by the rounding of a corner and holds less floor than this [m2] is outside."""


def find_inside(walls: Bool[np.ndarray, "rows columns"], resolution: float) -> Bool[np.ndarray, "rows columns"]:
    """The floor that walls enclose: true on it, false on walls and outside. ``resolution`` is the side of a cell [m].

    The outside is where a disc as wide as a door can roll to from the edge of the grid without touching a wall: it
    cannot roll through a door. What it cannot cover is inside, except for the corners that are too narrow for it.
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
    outside = np.asarray(distance_transform_edt(~outer)) * resolution <= radius
    cores, inside = fits & ~outer, ~walls & ~outside
    rooms = label_regions(inside)
    area = np.bincount(rooms.ravel()) * resolution**2
    # rooms that touch the outside and neither hold the disc nor much floor are corners of the outside
    numbers, beside = np.arange(len(area)), binary_dilation(outside)
    keep = ~np.isin(numbers, rooms[beside]) | np.isin(numbers, rooms[cores]) | (area >= POCKET)  # type: ignore[index]
    keep[0] = False
    return keep[rooms], cores & inside
