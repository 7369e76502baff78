"""The halves of the chain that are not the agent: legs under a navigator, or a navigator over legs."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from jaxtyping import Float

from vinl.chain.batching import batch_navigator, batch_policy
from vinl.chain.choose import load_navigator
from vinl.chain.config import EvaluationConfig
from vinl.chain.controller import open_controller
from vinl.chain.depth_cameras import DepthCameras, open_depth_cameras
from vinl.chain.navigators.base import Navigator, decide
from vinl.gym.trip import Trip
from vinl.policies.policy import Policy


class Legs:
    """A locomotor that carries out velocities.

    Attributes:
        gains: kp [N m / rad] and kd [N m s / rad] that it was trained with.
    """

    def __init__(self, policy: Policy) -> None:
        self._policy = batch_policy(policy)
        self.gains = float(policy.card.action["kp"]), float(policy.card.action["kd"])

    def enter(self, trip: Trip, ceiling: float | None) -> None:
        """A new episode begins."""
        self._controller = open_controller(self._policy, trip.task.space.plan, [trip.setup.blocks], ceiling)
        self._controller.reset(1)

    def choose(self, trip: Trip, command: Float[np.ndarray, "1 3"]) -> Float[np.ndarray, "12"]:
        """Joint targets [rad] of the next control step."""
        return self._controller.step(trip.qpos, trip.qvel, command, [0])[0]


class Guide:
    """A navigator that chooses the velocities, see ``Navigator``."""

    def __init__(self, navigator: str | Path | Navigator, rules: EvaluationConfig) -> None:
        by_name = isinstance(navigator, (str, Path))
        self._navigator = batch_navigator(load_navigator(navigator, rules) if by_name else navigator)
        self._cameras: DepthCameras | None = None

    def enter(self, trip: Trip, ceiling: float | None) -> None:
        """A new episode begins."""
        self._navigator.reset([trip.task])
        self._last = np.zeros((1, 2))
        camera = self._navigator.camera
        plan, blocks = trip.task.space.plan, [trip.setup.blocks]
        self._cameras = None if camera is None else open_depth_cameras(plan, blocks, camera, ceiling)

    def choose(self, trip: Trip) -> Float[np.ndarray, "2"]:
        """Forward speed [m/s] and yaw rate [rad/s] of the next half second."""
        depth = None if self._cameras is None else self._cameras.look(trip.qpos, [0])
        self._last = decide(self._navigator, trip.setup.route.goal[None], self._last, trip.pose, depth=depth)
        return self._last[0]
