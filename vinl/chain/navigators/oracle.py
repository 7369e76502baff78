"""A navigator that knows the floor plan and walks where the robot fits through, so that only the legs can fail."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from jaxtyping import Float

from vinl.chain.config import OracleConfig
from vinl.chain.navigators.base import Task
from vinl.chain.navigators.path import PlannedPath, plan_path
from vinl.config.errors import InputError
from vinl.robot.cameras import Camera
from vinl.robot.rotation import wrap_angle

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
