"""The oracle navigator: it knows the floor plan and follows the shortest way, so that only the legs can fail."""

from __future__ import annotations

import contextlib
from collections.abc import Sequence
from typing import Any

import numpy as np
from jaxtyping import Float

from vinl.config.errors import InputError
from vinl.evaluation.config import OracleConfig
from vinl.evaluation.navigator import Task
from vinl.robot.cameras import Camera
from vinl.world.free_space import FreeSpace
from vinl.world.geodesic import comfortable_path, path_length

_ROOM = 0.6
"""Clearance that the planned way seeks [m]: half the robot's length and some sway."""

_SQUEEZE = 0.32
"""Less clearance than this [m] is a squeeze: half the robot's width, the swing of its legs and some sway."""

_DETOUR = 1.5
"""A way around a squeeze may be so many times longer."""


class OracleNavigator:
    """Pure pursuit on a short way that keeps clear of walls where it can. Clutter is not known to it."""

    camera: Camera | None = None

    def __init__(self, config: OracleConfig | None = None) -> None:
        self.config = config or OracleConfig()
        self._tasks: Sequence[Task] = []
        self._ways: list[np.ndarray] = []
        self._along: list[int] = []

    def reset(self, episodes: Sequence[Task]) -> None:
        """Plan a way for every episode."""
        self._tasks = list(episodes)
        self._ways = [plan_way(task.space, task.route.start, task.route.goal) for task in self._tasks]
        self._along = [0] * len(self._tasks)

    def act(self, observation: dict[str, Any]) -> Float[np.ndarray, "n 2"]:
        """See ``Navigator.act``; reads ``pose``."""
        pose = np.asarray(observation["pose"], dtype=np.float64)
        target, left = np.empty((len(pose), 2)), np.empty(len(pose))
        for k in range(len(pose)):
            target[k], left[k] = self._aim(k, pose[k, :2])
        c, to = self.config, target - pose[:, :2]
        error = np.arctan2(to[:, 1], to[:, 0]) - pose[:, 2]
        error = (error + np.pi) % (2 * np.pi) - np.pi
        turn = np.clip(c.turn_gain * error, -c.turn_rate, c.turn_rate)
        # full speed straight ahead, none at the error where it turns on the spot; slower over the last metre
        ahead = np.clip(1.0 - np.abs(error) / c.turn_in_place, 0.0, 1.0) ** 0.5
        speed = c.speed * ahead * np.clip(0.3 + 0.7 * left, 0.3, 1.0)
        return np.stack([speed, turn], 1)

    def _aim(self, k: int, xy: np.ndarray) -> tuple[np.ndarray, float]:
        """The point of the way to head for, and the length of the way that is left [m]."""
        way, near = self._ways[k], self._nearest(k, xy)
        if np.linalg.norm(way[near] - xy) > self.config.replan_m:
            task = self._tasks[k]
            try:
                self._ways[k] = way = plan_way(task.space, xy, task.route.goal)
            except InputError:  # thrown off the floor plan: keep to the old way
                pass
            else:
                self._along[k] = 0
                near = self._nearest(k, xy)
        self._along[k] = near
        steps = np.linalg.norm(np.diff(way[near:], axis=0), axis=1).cumsum()
        ahead = near + 1 + int(np.searchsorted(steps, self.config.look_ahead))
        return way[min(ahead, len(way) - 1)], float(steps[-1]) if len(steps) else 0.0

    def _nearest(self, k: int, xy: np.ndarray) -> int:
        """The nearest point of the way within the next 2 m: it never jumps back, nor through a wall."""
        first = self._along[k]
        window = self._ways[k][first : first + 20]
        return first + int(np.linalg.norm(window - xy, axis=1).argmin())


def plan_way(space: FreeSpace, start: Float[np.ndarray, "2"], goal: Float[np.ndarray, "2"]) -> Float[np.ndarray, "k 2"]:
    """A way that goes through the middle of doors; its points are at most 0.1 m apart, its last is the goal.

    Gaps that the robot would only squeeze through are avoided where the way around is not much longer.

    Raises:
        InputError: if the goal cannot be reached from the start.
    """
    frame = space.plan.frame
    way = comfortable_path(space.traversable, space.clearance, frame, start, goal, room=_ROOM)
    cell = frame.cell(way)
    if space.clearance[cell[:, 0], cell[:, 1]].min() < _SQUEEZE:
        with contextlib.suppress(InputError):  # there may be no way around, or the robot stands in a gap
            roomy = comfortable_path(space.clearance >= _SQUEEZE, space.clearance, frame, start, goal, room=_ROOM)
            way = roomy if path_length(roomy) <= _DETOUR * path_length(way) else way
    return np.vstack([way, np.asarray(goal, dtype=np.float64)])
