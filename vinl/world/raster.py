"""Between pixels and boxes: rectangles out of a mask, boxes painted on a grid, specks dropped."""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Int
from scipy.ndimage import label

from vinl.config.errors import InputError
from vinl.world.boxes import Boxes
from vinl.world.grid import GridFrame


def label_regions(mask: Bool[np.ndarray, "rows columns"], corners: bool = False) -> Int[np.ndarray, "rows columns"]:
    """Number of each cell's connected region, from 1 on in the order of their first cells; 0 off the mask.

    Args:
        mask: the cells that count.
        corners: whether cells also join over corners, and not over edges only.
    """
    regions, _ = label(mask, np.ones((3, 3), bool) if corners else None)  # type: ignore[misc]
    return regions


def split_rectangles(mask: Bool[np.ndarray, "rows columns"], limit: int = 20_000) -> Int[np.ndarray, "n 4"]:
    """Few rectangles that together cover exactly the true cells of the mask.

    Greedy: the first cell not yet covered (row by row) grows into the larger of two rectangles, widest first or
    tallest first. Rectangles may overlap, which saves boxes where walls cross.

    Returns:
        One rectangle a row: first row, first column, one past the last row, one past the last column.

    Raises:
        InputError: if more than ``limit`` rectangles are needed: such a mask is noise, and no simulator takes it.
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
    if not len(boxes):
        return grid
    rows = boxes.rows.copy()
    turned = np.abs(np.sin(2 * rows[:, 2])) > 1e-6
    least = frame.resolution * np.where(turned, np.sqrt(2), 1.0)
    rows[:, 3], rows[:, 4] = np.maximum(rows[:, 3], least), np.maximum(rows[:, 4], least)
    # a straight box is a range of rows and columns; one turned by a quarter has its sides swapped
    quarter = np.abs(np.cos(rows[:, 2])) < 0.5
    reach = np.where(quarter[:, None], rows[:, [4, 3]], rows[:, [3, 4]]) / 2
    reach[turned] = (np.abs(Boxes(rows[turned]).corners() - rows[turned, None, :2])).max(1)
    x, y = frame.centres()
    first = np.column_stack(
        [np.searchsorted(line, rows[:, k] - reach[:, k] - 1e-9) for k, line in ((0, x), (1, y))]
    ).tolist()
    last = np.column_stack(
        [np.searchsorted(line, rows[:, k] + reach[:, k] + 1e-9, side="right") for k, line in ((0, x), (1, y))]
    ).tolist()
    for row, askew, (c0, r0), (c1, r1) in zip(rows, turned.tolist(), first, last, strict=True):
        if not askew:
            grid[r0:r1, c0:c1] = True
        elif c0 < c1 and r0 < r1:
            dx, dy = x[None, c0:c1] - row[0], y[r0:r1, None] - row[1]
            c, s = np.cos(row[2]), np.sin(row[2])
            held = (np.abs(c * dx + s * dy) <= row[3] / 2 + 1e-9) & (np.abs(c * dy - s * dx) <= row[4] / 2 + 1e-9)
            grid[r0:r1, c0:c1] |= held
    return grid
