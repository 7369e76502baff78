"""A trained navigator in the chain: goal, depth and its own last step in, velocities out; how robots moved between two
decisions, and where they believe to be."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import torch
from jaxtyping import Bool, Float

from vinl.chain.navigators.base import Task
from vinl.config.errors import InputError
from vinl.policies.card import NAVIGATION_TABLE, PolicyCard, find_previous
from vinl.policies.policy import Policy
from vinl.policies.velocity_range import VelocityRange
from vinl.robot.cameras import Camera
from vinl.robot.rotation import wrap_angle
from vinl.sensing.odometry import Odometry
from vinl.sensing.sensor_config import OdometryConfig


def measure_twist(
    before: Float[np.ndarray, "n 3"], after: Float[np.ndarray, "n 3"], period: float
) -> Float[np.ndarray, "n 3"]:
    """The constant forward [m/s], sideways [m/s] and yaw [rad/s] rates that lead from one pose to the other on an arc.

    Args:
        before, after: x, y [m] and yaw [rad].
        period: between them [s].
    """
    step = after[:, :2] - before[:, :2]
    turn = wrap_angle(after[:, 2] - before[:, 2])
    chord = np.sinc(turn / 2 / np.pi)  # chord over arc
    heading = before[:, 2] + turn / 2
    c, s = np.cos(heading), np.sin(heading)
    forward, left = c * step[:, 0] + s * step[:, 1], -s * step[:, 0] + c * step[:, 1]
    return np.stack([forward / chord, left / chord, turn], 1) / period


def step_between(before: Float[np.ndarray, "n 3"], after: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 3"]:
    """From one pose (x, y [m] and yaw [rad]) to the next, in the heading frame of the first [m, m, rad]."""
    x, y, turn = (after - before).T
    c, s = np.cos(before[:, 2]), np.sin(before[:, 2])
    return np.stack([c * x + s * y, c * y - s * x, wrap_angle(turn)], 1)


class DeadReckoning:
    """The odometry of n robots; the same key gives the same errors.

    Args:
        keys: (n,) below 2^31.
    """

    def __init__(self, config: OdometryConfig, keys: Sequence[int]) -> None:
        self._odometry = Odometry(config, len(keys))
        self._keys = torch.tensor(list(keys), dtype=torch.int32)
        self._at: torch.Tensor | None = None

    def follow(self, pose: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 3"]:
        """Where the robots believe to be, x, y [m] and yaw [rad], when they are at ``pose``; the first call is the
        start, which they know."""
        at = torch.as_tensor(pose[:, :2], dtype=torch.float32)
        if self._at is None:
            self._odometry.restart(self._keys, torch.ones(len(at), dtype=torch.bool), at)
        else:
            self._odometry.advance(self._at, at)
        self._at = at
        believed = self._odometry.state["estimate"].numpy().astype(np.float64)
        return np.column_stack([believed[:, :2], pose[:, 2] + believed[:, 2]])


_DISTANCE_SCALE = float(NAVIGATION_TABLE[0]["scale"][0])


class LearnedNavigator:
    """Drives the robots of a unit by a policy of kind "navigation", without noise.

    A policy whose card lists ``previous_motion`` gets what the robot did since the last decision, from its poses (from
    odometry, on a robot), as in its training (``vinl.policies.card.PREVIOUS_MOTION``): a robot that walks against a
    wall reads that it stands. One whose card lists ``previous_action`` gets what it asked for; a card may list both.
    ``previous_step`` is how far it came since then, by the same poses.

    Args:
        policy: observes (n, 5, 7 or 8): distance / 5 m, cosine and sine of the bearing, and its last step; and depth.
        period: between two decisions [s].

    Attributes:
        camera: the policy's camera, None if it is blind.

    Raises:
        InputError: the policy is of another kind.
    """

    def __init__(self, policy: Policy, period: float = 0.5) -> None:
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
        action = self.policy.act(vector) if self.camera is None else self.policy.act(vector, observation["depth"])
        self._last = np.clip(np.asarray(action, np.float32), -1.0, 1.0)
        return self._range.velocity(self._last)

    def occupied(self) -> Float[np.ndarray, "k 2"]:
        """What stands around a single robot by the grid that its policy keeps, in the heading frame of the last
        decision [m]; no points if it keeps none."""
        found = getattr(self.policy, "occupied", list[np.ndarray])()
        return found[0] if found else np.zeros((0, 2), np.float32)

    def overrule(self, which: Bool[np.ndarray, " n"], velocity: Float[np.ndarray, "n 2"]) -> None:
        """These robots do something else than the policy said: that is what it knows as its last action."""
        self._last[which] = self._range.action(velocity[which])

    def _measure(self, pose: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n k"]:
        """The motion since the last decision in units of the action, or the step; zero at the first."""
        before, self._pose = self._pose, pose.copy()
        if before is None:
            return np.zeros((len(pose), 3 if self._previous == "step" else 2), np.float32)
        if self._previous == "step":
            return step_between(before, pose).astype(np.float32)
        return self._range.action(measure_twist(before, pose, self._period)[:, [0, 2]])
