"""Distance fields to many goals at once by compiled code on the CPU: fast enough to build homes while training runs."""

# ruff: noqa: UP018, RUF046 - a variable of a kernel that changes must be made by its type
# pyright: reportInvalidTypeForm=false, reportCallIssue=false, reportArgumentType=false
# pyright: reportOperatorIssue=false, reportIndexIssue=false, reportAttributeAccessIssue=false

import math
from typing import no_type_check

import numpy as np
import warp as wp
from jaxtyping import Float, Int, UInt8

from vinl.sensing.warp_start import start_warp

start_warp()
wp.set_module_options({"enable_backward": False})

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


def _wrap(values: np.ndarray) -> wp.array:
    """The same memory, for a kernel."""
    return wp.array(values, copy=False, device="cpu")


BUCKETS = wp.constant(256)
"""More than the dearest step."""


@wp.kernel
@no_type_check
def spread_distances(
    mask: wp.array(dtype=wp.uint8),
    goal: wp.array(dtype=wp.int32),
    offset: wp.array(dtype=wp.int32),
    cost: wp.array(dtype=wp.int32),
    distance: wp.array(dtype=wp.int32, ndim=2),
    head: wp.array(dtype=wp.int32, ndim=2),
    following: wp.array(dtype=wp.int32, ndim=2),
    cell: wp.array(dtype=wp.int32, ndim=2),
):
    """Dijkstra's search with buckets, one thread a goal. Cells of mask 2 are passed, cells of mask 1 only reached.

    ``distance`` begins far off, and below 0 where no path enters. ``head`` holds a linked list of waiting entries for
    each bucket, ``following`` and ``cell`` the entries.
    """
    k = wp.tid()
    used = int(1)  # entries taken from the pool so far
    spare = int(-1)  # list of entries given back
    waiting = int(1)
    band = int(0)
    distance[k, goal[k]] = 0
    head[k, 0] = 0
    following[k, 0] = -1
    cell[k, 0] = goal[k]
    while waiting > 0:
        bucket = band % BUCKETS
        entry = head[k, bucket]
        while entry >= 0:
            head[k, bucket] = following[k, entry]
            here = cell[k, entry]
            following[k, entry] = spare
            spare = entry
            waiting = waiting - 1
            if distance[k, here] == band and mask[here] == wp.uint8(2):
                for s in range(offset.shape[0]):
                    there = here + offset[s]
                    total = band + cost[s]
                    if total < distance[k, there]:
                        fresh = spare
                        if fresh >= 0:
                            spare = following[k, fresh]
                        else:
                            fresh = used
                            used = used + 1
                        if fresh < cell.shape[1]:
                            distance[k, there] = total
                            target = total % BUCKETS
                            cell[k, fresh] = there
                            following[k, fresh] = head[k, target]
                            head[k, target] = fresh
                            waiting = waiting + 1
            entry = head[k, bucket]
        band = band + 1


@wp.kernel
@no_type_check
def write_metres(
    counted: wp.array(dtype=wp.int32, ndim=3),
    border: wp.int32,
    far: wp.int32,
    unit: wp.float32,
    metres: wp.array(dtype=wp.float16, ndim=3),
):
    """Counted distances (goal, row, column) without their border as metres (row, column, goal)."""
    r, c = wp.tid()
    for k in range(metres.shape[2]):
        steps = counted[k, r + border, c + border]
        metres[r, c, k] = wp.where(steps >= 0 and steps < far, wp.float16(wp.float32(steps) * unit), wp.float16(wp.inf))
