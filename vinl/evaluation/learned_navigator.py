"""A trained navigator in the chain: goal, depth and its own last action in, velocities out."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from jaxtyping import Float

from vinl.config.errors import InputError
from vinl.evaluation.navigator import Task
from vinl.policies.card import FORWARD_SPEED, NAVIGATION_TABLE, YAW_RATE, PolicyCard
from vinl.policies.policy import Policy
from vinl.robot.cameras import Camera

_DISTANCE_SCALE = float(NAVIGATION_TABLE[0]["scale"][0])


class LearnedNavigator:
    """Drives the robots of a unit by a policy of kind "navigation", without noise.

    Attributes:
        policy: observes (n, 5): distance / 5 m, cosine and sine of the bearing, and its last action; and depth.
        camera: the policy's camera, None if it is blind.

    Raises:
        InputError: the policy is of another kind.
    """

    def __init__(self, policy: Policy) -> None:
        if policy.card.kind != "navigation":
            raise InputError(
                f"{policy.card.name} is a {policy.card.kind} policy; a navigator (--nav) is oracle or a navigation "
                "policy"
            )
        self.policy = policy
        self.camera: Camera | None = policy.camera
        action = policy.card.action
        low, high = np.array([action.get("forward_speed", FORWARD_SPEED), action.get("yaw_rate", YAW_RATE)]).T
        self._middle, self._half = (high + low) / 2, (high - low) / 2
        self._last = np.zeros((0, 2), np.float32)

    @property
    def card(self) -> PolicyCard:
        """The policy's card."""
        return self.policy.card

    def reset(self, episodes: Sequence[Task]) -> None:
        """See ``Navigator.reset``; what it may know about the episodes is left alone."""
        self.policy.reset(len(episodes))
        self._last = np.zeros((len(episodes), 2), np.float32)

    def act(self, observation: dict[str, Any]) -> Float[np.ndarray, "n 2"]:
        """See ``Navigator.act``; reads ``goal`` and ``depth``."""
        goal = np.asarray(observation["goal"], np.float32) * np.array([_DISTANCE_SCALE, 1.0, 1.0], np.float32)
        vector = np.concatenate([goal, self._last], 1)
        action = self.policy.act(vector) if self.camera is None else self.policy.act(vector, observation["depth"])
        self._last = np.clip(np.asarray(action, np.float32), -1.0, 1.0)
        return self._middle + self._half * self._last.astype(np.float64)
