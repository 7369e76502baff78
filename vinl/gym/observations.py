"""What an agent of an environment observes: spaces, and the numbers that fill them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from gymnasium import spaces
from jaxtyping import Float

from vinl.chain.depth_cameras import DepthCameras, open_depth_cameras
from vinl.chain.ground_reader import ScanReader
from vinl.config.errors import InputError
from vinl.config.loader import closest
from vinl.gym.trip import Trip
from vinl.policies.card import NAVIGATION_TABLE
from vinl.robot.cameras import LOCOMOTION_CAMERA, Camera
from vinl.robot.observation import CLIP, PROPRIOCEPTION_SIZE, SCAN_SIZE, observe

Cameras = Mapping[str, "str | Camera"]

FARTHEST = 200.0
"""Distances in the observation are held to this, in units of 5 m: spaces need a bound."""

_GOAL_SCALE = np.array([NAVIGATION_TABLE[0]["scale"][0], 1.0, 1.0], np.float32)
_GOAL_LOW, _GOAL_HIGH = np.array([0, -1, -1], np.float32), np.array([FARTHEST, 1, 1], np.float32)
_TAKEN = ("vector", "goal", "proprioception", "height_scan")


def choose_cameras(chosen: Cameras | None, joints: bool, navigation: Camera | None) -> dict[str, Camera]:
    """The cameras of an environment by the name of their images.

    Args:
        chosen: records, or the names ``"navigation"`` and ``"locomotion"``; None: one image ``depth``, of the
            locomotion camera for an agent of joints, else of the navigation camera.
        navigation: the navigator's camera, None if its config is blind.

    Raises:
        InputError: an unknown name, or an image named like another observation.
    """
    known = {"navigation": navigation, "locomotion": LOCOMOTION_CAMERA}
    if chosen is None:
        chosen = {"depth": LOCOMOTION_CAMERA} if joints else {"depth": navigation} if navigation else {}
    cameras = {}
    for image, camera in chosen.items():
        if image in _TAKEN:
            raise InputError(f"cameras: an image cannot be called {image!r}, another observation is")
        record = known.get(camera) if isinstance(camera, str) else camera
        if record is None:
            raise InputError(f"cameras: no camera {camera!r}{closest(str(camera), known)}; known: {', '.join(known)}")
        cameras[image] = record
    return cameras


class AgentObservation:
    """What the agent observes.

    Args:
        joints: whether it moves the joints, else it chooses velocities.
        cameras: by the name of their images.
        height_scan: whether it also reads the height of the ground.
        steps: numbers that it knows of its last step.
    """

    def __init__(self, joints: bool, cameras: Mapping[str, Camera], height_scan: bool, steps: int) -> None:
        self._joints, self._cameras, self._with_scan = joints, dict(cameras), height_scan
        parts: dict[str, spaces.Space[Any]] = {}
        if joints:
            parts["goal"] = spaces.Box(_GOAL_LOW, _GOAL_HIGH, dtype=np.float32)
            parts["proprioception"] = spaces.Box(-CLIP, CLIP, (PROPRIOCEPTION_SIZE,), np.float32)
        else:
            ends = np.ones(steps, np.float32)
            low, high = np.concatenate([_GOAL_LOW, -ends]), np.concatenate([_GOAL_HIGH, ends])
            parts["vector"] = spaces.Box(low, high, dtype=np.float32)
        if height_scan:
            parts["height_scan"] = spaces.Box(-CLIP, CLIP, (SCAN_SIZE,), np.float32)
        for image, camera in cameras.items():
            parts[image] = spaces.Box(0.0, 1.0, (camera.height, camera.width), np.float32)
        self.space = spaces.Dict(parts)
        self._depth: dict[str, DepthCameras] = {}
        self._scan: ScanReader | None = None

    def enter(self, trip: Trip, ceiling: float | None) -> None:
        """A new episode begins, in a home with or without a ceiling [m]."""
        plan, blocks = trip.task.space.plan, [trip.setup.blocks]
        self._depth = {
            image: open_depth_cameras(plan, blocks, camera, ceiling) for image, camera in self._cameras.items()
        }
        self._scan = ScanReader(plan, blocks) if self._with_scan else None

    def observe(
        self, trip: Trip, command: Float[np.ndarray, "1 3"], previous: Float[np.ndarray, "1 a"]
    ) -> dict[str, np.ndarray]:
        """The observation of this moment.

        Args:
            command: velocities that it shall have.
            previous: the last step; of an agent of joints its action in the locomotor's units.
        """
        goal = np.clip(trip.goal[0].astype(np.float32) * _GOAL_SCALE, _GOAL_LOW, _GOAL_HIGH)
        qpos, parts = trip.qpos, {}
        if self._joints or self._scan is not None:
            ground = np.zeros((1, SCAN_SIZE)) if self._scan is None else self._scan.read(qpos)
            last = previous if self._joints else np.zeros((1, 12), np.float32)
            numbers = observe(np, qpos, trip.qvel, command, last, ground)[0].astype(np.float32)
            if self._joints:
                parts["proprioception"] = numbers[:PROPRIOCEPTION_SIZE]
            if self._scan is not None:
                parts["height_scan"] = numbers[PROPRIOCEPTION_SIZE:]
        if self._joints:
            parts["goal"] = goal
        else:
            parts["vector"] = np.concatenate([goal, previous[0].astype(np.float32)])
        for image, cameras in self._depth.items():
            parts[image] = cameras.camera.normalise(cameras.look(qpos)[0]).numpy().copy()
        return parts
