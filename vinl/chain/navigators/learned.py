"""A trained navigator in the chain: goal, depth and its own last step in, velocities out."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from jaxtyping import Float

from vinl.chain.navigators.base import Task
from vinl.chain.navigators.recovery import Recovery, StuckPlaces
from vinl.chain.odometry import measure_twist
from vinl.config.errors import InputError
from vinl.policies.card import NAVIGATION_TABLE, PolicyCard, find_previous
from vinl.policies.policy import Policy
from vinl.policies.velocity_range import VelocityRange
from vinl.robot.cameras import Camera

_DISTANCE_SCALE = float(NAVIGATION_TABLE[0]["scale"][0])

_RECOVERY_SPEED = 0.5
"""Forward speed of a robot that is being freed [m/s]: half of what it can do."""


class LearnedNavigator:
    """Drives the robots of a unit by a policy of kind "navigation", without noise.

    A policy whose card lists ``previous_motion`` gets what the robot did since the last decision, from its poses (from
    odometry, on a robot), as in its training (``vinl.policies.card.PREVIOUS_MOTION``): a robot that walks against a
    wall reads that it stands. One whose card lists ``previous_action`` gets what it asked for; a card may list both.

    Args:
        policy: observes (n, 5 or 7): distance / 5 m, cosine and sine of the bearing, and its last step; and depth.
        period: between two decisions [s].
        recover: free robots that have not moved for a while (``Recovery``), whatever the policy says, and let it see a
            post where they were stuck (``StuckPlaces``).

    Attributes:
        policy: as given.
        camera: the policy's camera, None if it is blind.

    Raises:
        InputError: the policy is of another kind.
    """

    def __init__(self, policy: Policy, period: float = 0.5, recover: bool = True) -> None:
        if policy.card.kind != "navigation":
            raise InputError(
                f"{policy.card.name} is a {policy.card.kind} policy; a navigator (--nav) is oracle or a navigation "
                "policy"
            )
        self.policy = policy
        self.camera: Camera | None = policy.camera
        self._range = VelocityRange.of(policy.card)
        self._period, self._previous = period, find_previous(policy.card)
        self._last = np.zeros((0, 2), np.float32)
        self._pose: np.ndarray | None = None
        self._recover = recover
        self.reset([])

    @property
    def card(self) -> PolicyCard:
        """The policy's card."""
        return self.policy.card

    def reset(self, episodes: Sequence[Task]) -> None:
        """See ``Navigator.reset``; what it may know about the episodes is left alone."""
        self.policy.reset(len(episodes))
        self._last = np.zeros((len(episodes), 2), np.float32)
        self._pose = None
        # walks ahead at the given speed, turns at the policy's highest rate
        rate = float(self._range.velocity(np.ones((1, 2), np.float32))[0, 1])
        self._recovery = Recovery(len(episodes), _RECOVERY_SPEED, rate)
        seen = self.camera if self._recover else None
        self._places = None if seen is None else StuckPlaces(len(episodes), seen, self._period)

    def act(self, observation: dict[str, Any]) -> Float[np.ndarray, "n 2"]:
        """See ``Navigator.act``; reads ``goal``, ``depth`` and, to see how far the robot came, ``pose``."""
        pose = np.asarray(observation["pose"], np.float64)
        goal = np.asarray(observation["goal"], np.float32) * np.array([_DISTANCE_SCALE, 1.0, 1.0], np.float32)
        parts = [goal]
        if self._previous != "motion":
            parts.append(self._last)
        if self._previous != "action":
            parts.append(self._measure(pose))
        vector = np.concatenate(parts, 1)
        if self.camera is None:
            action = self.policy.act(vector)
        else:
            depth = observation["depth"]
            action = self.policy.act(vector, depth if self._places is None else self._places.draw(pose, depth))
        self._last = np.clip(np.asarray(action, np.float32), -1.0, 1.0)
        choice = self._range.velocity(self._last)
        if not self._recover:
            return choice
        choice, freed = self._recovery.correct(pose, choice)
        if self._places is not None:
            self._places.remember(self._recovery.found, pose)
        self._last[freed] = self._range.action(choice[freed])
        return choice

    def _measure(self, pose: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 2"]:
        """The motion since the last decision in units of the action; zero at the first."""
        before, self._pose = self._pose, pose.copy()
        if before is None:
            return np.zeros((len(pose), 2), np.float32)
        return self._range.action(measure_twist(before, pose, self._period)[:, [0, 2]])
