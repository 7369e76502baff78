"""A navigator that knows the floor plan and walks where the robot fits through, so that only the legs can fail. Its
path is roomy where the plan allows it, not always the shortest."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float
from scipy.ndimage import minimum_filter1d

from vinl.chain.config import OracleConfig
from vinl.chain.navigators.base import Task
from vinl.config.errors import InputError
from vinl.robot.cameras import Camera
from vinl.robot.rotation import wrap_angle
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


_SLOWEST = 0.6
"""Fraction of the speed and of the look-ahead that is left in the narrowest gaps: at 2 Hz and full speed the robot
would walk through half of a doorway between two decisions."""


class OracleNavigator:
    """Pure pursuit on a short path that keeps clear of walls where it can. Clutter is not known to it."""

    camera: Camera | None = None

    def __init__(self, config: OracleConfig | None = None) -> None:
        self.config = config or OracleConfig()
        self._tasks: Sequence[Task] = []
        self._paths: list[PlannedPath] = []
        self._along: list[int] = []

    def reset(self, episodes: Sequence[Task]) -> None:
        """Plan a path for every episode."""
        self._tasks = list(episodes)
        self._paths = [plan_path(task.space, task.route.start, task.route.goal) for task in self._tasks]
        self._along = [0] * len(self._tasks)

    def act(self, observation: dict[str, Any]) -> Float[np.ndarray, "n 2"]:
        """See ``Navigator.act``; reads ``true_pose``, or ``pose`` where there is no other."""
        pose = np.asarray(observation.get("true_pose", observation["pose"]), dtype=np.float64)
        target, left, ease = np.empty((len(pose), 2)), np.empty(len(pose)), np.empty(len(pose))
        for k in range(len(pose)):
            target[k], left[k], ease[k] = self._aim(k, pose[k, :2])
        c, to = self.config, target - pose[:, :2]
        error = np.arctan2(to[:, 1], to[:, 0]) - pose[:, 2]
        error = wrap_angle(error)
        turn = np.clip(c.turn_gain * error, -c.turn_rate, c.turn_rate)
        # full speed straight ahead, none at the error where it turns on the spot; slower over the last metre
        ahead = np.clip(1.0 - np.abs(error) / c.turn_in_place, 0.0, 1.0) ** 0.5
        speed = c.speed * ahead * np.clip(0.3 + 0.7 * left, 0.3, 1.0) * ease
        return np.stack([speed, turn], 1)

    def _aim(self, k: int, xy: np.ndarray) -> tuple[np.ndarray, float, float]:
        """The point of the path to head for, the length of the path that is left [m], and the fraction of the speed."""
        near = self._nearest(k, xy)
        if np.linalg.norm(self._paths[k].points[near] - xy) > self.config.replan_m:
            task = self._tasks[k]
            try:
                self._paths[k] = plan_path(task.space, xy, task.route.goal)
            except InputError:  # thrown off the floor plan: keep to the old path
                pass
            else:
                self._along[k] = 0
                near = self._nearest(k, xy)
        self._along[k] = near
        path = self._paths[k]
        ease = _SLOWEST + (1.0 - _SLOWEST) * float(path.ease[near])
        steps = np.linalg.norm(np.diff(path.points[near:], axis=0), axis=1).cumsum()
        ahead = near + 1 + int(np.searchsorted(steps, self.config.look_ahead * ease))
        return path.points[min(ahead, len(path.points) - 1)], float(steps[-1]) if len(steps) else 0.0, ease

    def _nearest(self, k: int, xy: np.ndarray) -> int:
        """The nearest point of the path within the next 2 m: it never jumps back, nor through a wall."""
        first = self._along[k]
        window = self._paths[k].points[first : first + 20]
        return first + int(np.linalg.norm(window - xy, axis=1).argmin())
