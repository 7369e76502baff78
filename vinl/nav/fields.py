"""Distance fields to many goals at once, and clearance, by compiled code on the CPU: fast enough to build homes while
training runs."""

from __future__ import annotations

import math

import numpy as np
import warp as wp
from jaxtyping import Bool, Float, Int, UInt8

from vinl.nav.field_kernels import measure_across, measure_down, spread_distances, write_metres

_UNIT = 100
"""Distances are counted in hundredths of a cell."""

_STEPS = [(i, j) for i in range(-2, 3) for j in range(-2, 3) if math.gcd(i, j) == 1]
_BORDER = 2
_FAR, _CLOSED = 2**30, -1


def spread_fields(
    mask: UInt8[np.ndarray, "rows columns"], goals: Int[np.ndarray, "k 2"], resolution: float
) -> Float[np.ndarray, "rows columns k"]:
    """Length of the shortest path to every goal from every cell, over a grid with 16 neighbours (straight, diagonal
    and knight's moves): at most 2.8 % longer than the true one in open space, 1 % on average.

    Args:
        mask: 2 where paths may lead, 1 where they may only begin (too near to a wall to lead on), 0 elsewhere.
        goals: cells (row, column), each of mask 2.
        resolution: side of a cell [m].

    Returns:
        float16 [m], infinite where the goal cannot be reached from.
    """
    padded = np.ascontiguousarray(np.pad(mask, _BORDER))
    width, cells = padded.shape[1], padded.size
    steps = np.array(_STEPS)
    offset = (steps[:, 0] * width + steps[:, 1]).astype(np.int32)
    cost = np.rint(np.hypot(steps[:, 0], steps[:, 1]) * _UNIT).astype(np.int32)
    start = ((goals[:, 0] + _BORDER) * width + goals[:, 1] + _BORDER).astype(np.int32)
    count = len(goals)
    # cells that no path enters are nearer than anything, so that one comparison tells both
    distance = np.tile(np.where(padded.ravel() == 0, _CLOSED, _FAR).astype(np.int32), (count, 1))
    pool = 2 * cells
    wp.launch(
        spread_distances,
        dim=count,
        inputs=[
            _wrap(padded.ravel()),
            _wrap(start),
            _wrap(offset),
            _wrap(cost),
            _wrap(distance),
            _wrap(np.full((count, 256), -1, np.int32)),
            _wrap(np.empty((count, pool), np.int32)),
            _wrap(np.empty((count, pool), np.int32)),
        ],
        device="cpu",
    )
    metres = np.empty((*mask.shape, count), np.float16)
    counted = _wrap(distance.reshape(count, *padded.shape))
    wp.launch(
        write_metres,
        dim=mask.shape,
        inputs=[counted, _BORDER, _FAR, resolution / _UNIT],
        outputs=[_wrap(metres)],
        device="cpu",
    )
    return metres


def measure_near_clearance(
    free: Bool[np.ndarray, "rows columns"], resolution: float, reach: float
) -> Float[np.ndarray, "rows columns"]:
    """Distance from each cell's centre to the edge of the nearest cell that is not free, where the outside is not free.

    Args:
        free: the floor.
        resolution: side of a cell [m].
        reach: distances beyond this read as about this [m].

    Returns:
        float16 [m]; 0 where not free.
    """
    cells = math.ceil(reach / resolution) + 1
    floor = np.ascontiguousarray(np.pad(free, 1).astype(np.uint8))
    gap = _wrap(np.empty(floor.shape, np.int32))
    clearance = np.empty(floor.shape, np.float16)
    wp.launch(measure_down, dim=floor.shape[1], inputs=[_wrap(floor), cells], outputs=[gap], device="cpu")
    wp.launch(
        measure_across, dim=floor.shape, inputs=[gap, cells, resolution], outputs=[_wrap(clearance)], device="cpu"
    )
    return np.ascontiguousarray(clearance[1:-1, 1:-1])


def _wrap(values: np.ndarray) -> wp.array:
    """The same memory, for a kernel."""
    return wp.array(values, copy=False, device="cpu")
