"""A navigator that knows the home and follows a roomy short way to the goal: what the kinematics allow at best."""

from __future__ import annotations

import numpy as np
import torch
import warp as wp
from torch import Tensor

from vinl.nav.environment import NavEnvironment
from vinl.nav.home_builder import FIELD_RESOLUTION, FINE
from vinl.policies.velocity_range import VelocityRange
from vinl.robot.rotation import wrap_angle
from vinl.world.geodesic import comfortable_path
from vinl.world.grid import GridFrame

_LOOK_AHEAD = 0.6
"""Distance along the way to the point that the robot heads for [m]."""

_TURN_IN_PLACE = 0.6
"""Heading error beyond which the robot turns before it drives on [rad]."""

_SPEED = 0.8
"""Forward speed on a straight way [m/s]."""

_TROUBLE = 6
"""At most so many steps in a row a robot that would have touched something moves at random."""


class PathFollower:
    """Plans a way for the present episode of every robot, and drives along it by pure pursuit.

    Args:
        environment: whose robots it drives; their episodes have just begun.
    """

    def __init__(self, environment: NavEnvironment) -> None:
        self._environment = environment
        state = {name: environment.state[name].cpu().numpy() for name in ("home", "goal", "position")}
        goals = environment.goals().cpu().numpy()
        self._ways = [
            self._plan(int(home), int(goal), start, end)
            for home, goal, start, end in zip(state["home"], state["goal"], state["position"], goals, strict=True)
        ]
        self._along = np.zeros(len(self._ways), dtype=int)
        self._trouble = np.zeros(len(self._ways), dtype=int)
        self._chance = np.random.Generator(np.random.Philox(environment.config.seed))

    def act(self) -> Tensor:
        """Actions (n, 2) in [-1, 1] for the present state."""
        environment, robot = self._environment, self._environment.config.robot
        position = environment.state["position"].cpu().numpy()
        yaw = environment.state["yaw"].cpu().numpy()
        blocked = environment.state["in_a_row"].cpu().numpy()
        to = np.array([self._aim(k, xy) for k, xy in enumerate(position)]) - position
        error = wrap_angle(np.arctan2(to[:, 1], to[:, 0]) - yaw)
        turn = np.clip(error / robot.period / robot.max_yaw_rate, -1.0, 1.0)
        # straight to a near point, not past it; nothing where the robot has to turn first
        speed = np.minimum(_SPEED, np.linalg.norm(to, axis=1) / robot.period)
        speed *= np.clip(1.0 - np.abs(error) / _TURN_IN_PLACE, 0.0, 1.0)
        # a step that was cancelled would be cancelled again: do something else for a while
        self._trouble = np.clip(self._trouble + np.where(blocked > 0, 2, -1), 0, _TROUBLE)
        free = self._chance.uniform(size=(2, len(yaw)))
        speed = np.where(self._trouble > 0, np.maximum(free[0] - 0.3, 0.0), speed)
        turn = np.where(self._trouble > 0, 2.0 * free[1] - 1.0, turn)
        span = VelocityRange((robot.min_speed, robot.max_speed), (-1.0, 1.0))  # turn is a share of the fastest already
        return torch.as_tensor(span.action(np.stack([speed, turn], 1)), device=environment.device)

    def _aim(self, k: int, xy: np.ndarray) -> np.ndarray:
        """The point of the way to head for."""
        way, first = self._ways[k], self._along[k]
        window = way[first : first + 20]  # never jumps through a wall
        near = first + int(np.linalg.norm(window - xy, axis=1).argmin())
        self._along[k] = near
        steps = np.linalg.norm(np.diff(way[near:], axis=0), axis=1).cumsum()
        return way[min(near + 1 + int(np.searchsorted(steps, _LOOK_AHEAD)), len(way) - 1)]

    def _plan(self, home: int, goal: int, start: np.ndarray, end: np.ndarray) -> np.ndarray:
        grids = self._environment.homes.homes
        first, shape = int(wp.to_torch(grids.first)[home]), wp.to_torch(grids.shape)[home].tolist()
        cells = shape[0] * shape[1]
        field = wp.to_torch(grids.fields)[first : first + cells, goal].float().cpu().numpy().reshape(shape)
        fine = wp.to_torch(grids.clearance)[4 * first : 4 * (first + cells)].float().cpu().numpy()
        clearance = fine.reshape(FINE * shape[0], FINE * shape[1])[::FINE, ::FINE]
        x0, y0 = wp.to_torch(grids.origin)[home].tolist()
        frame = GridFrame(x0, y0, FIELD_RESOLUTION, (shape[0], shape[1]))
        known = np.isfinite(field)
        ways = known & (clearance >= self._environment.config.homes.path_radius - 1e-3)
        return comfortable_path(ways, clearance, frame, start.astype(float), end.astype(float))
