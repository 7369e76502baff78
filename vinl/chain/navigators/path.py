"""The path that the oracle follows: roomy where the plan allows it, not always the shortest."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.ndimage import minimum_filter1d

from vinl.config.errors import InputError
from vinl.world.free_space import FIT_RADIUS, PATH_SPACING, FreeSpace, comfortable_path, path_length

_ROOM = 0.7
"""Clearance that the planned path seeks [m]: the robot's length. It comes to doors head on."""

_EASY = 0.34
"""Less clearance than this [m] is a squeeze: half the robot's width over the legs, and ample sway."""

_TIGHT = 0.22
"""Clearance of the narrowest gaps [m]."""

_DETOUR = 2.0
"""The path around a squeeze that the robot fits through may be so many times longer; the path around a gap that it does
not fit through may have any length."""

_FREE = 0.3
"""Around its start and its goal [m] a path may begin and end closer to walls than it goes elsewhere."""


@dataclass(frozen=True, eq=False)
class PlannedPath:
    """A planned path.

    Attributes:
        points: shape (k, 2) [m], at most 0.1 m apart; the last is the goal.
        ease: shape (k,), from 0 in the narrowest gaps, half a metre before and behind them, to 1 on open floor.
    """

    points: Float[np.ndarray, "k 2"]
    ease: Float[np.ndarray, " k"]


def plan_path(space: FreeSpace, start: Float[np.ndarray, "2"], goal: Float[np.ndarray, "2"]) -> PlannedPath:
    """A path through the middle of doors, clear of walls and furniture where there is space.

    Gaps that the robot does not fit through (``FIT_RADIUS``) are on the path only if no other path leads to the goal;
    gaps that it would just fit through are avoided where the path around is not much longer.

    Raises:
        InputError: if the goal cannot be reached from the start.
    """
    path = _find_path(space, FIT_RADIUS, start, goal)
    if path is None:
        path = _find_path(space, space.radius, start, goal)
    if path is None:
        raise InputError(f"no path leads from ({start[0]:.2f}, {start[1]:.2f}) to ({goal[0]:.2f}, {goal[1]:.2f})")
    if _read_clearance(space, path).min() < _EASY:
        roomy = _find_path(space, _EASY, start, goal)
        if roomy is not None and path_length(roomy) <= _DETOUR * path_length(path):
            path = roomy
    points = np.vstack([path, np.asarray(goal, dtype=np.float64)])
    room = minimum_filter1d(_read_clearance(space, points), 2 * round(0.5 / PATH_SPACING) + 1, mode="nearest")
    return PlannedPath(points, np.clip((room - _TIGHT) / (_ROOM - 0.2 - _TIGHT), 0.0, 1.0).astype(np.float64))


def _find_path(space: FreeSpace, radius: float, start: np.ndarray, goal: np.ndarray) -> np.ndarray | None:
    """A path for a robot of that radius, or none. Start and goal themselves may lie in narrow places."""
    frame = space.plan.frame
    mask = space.clearance >= radius
    for point in (start, goal):
        row, column = frame.cell(np.asarray(point, dtype=np.float64))
        if not mask[row, column]:
            ys, xs = frame.centres()[1], frame.centres()[0]
            mask |= space.traversable & (np.hypot(xs[None] - point[0], ys[:, None] - point[1]) < _FREE)
    try:
        return comfortable_path(mask, space.clearance, frame, start, goal, room=_ROOM)
    except InputError:
        return None


def _read_clearance(space: FreeSpace, points: Float[np.ndarray, "k 2"]) -> Float[np.ndarray, " k"]:
    cell = space.plan.frame.cell(points)
    return space.clearance[cell[:, 0], cell[:, 1]]
