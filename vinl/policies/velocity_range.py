"""A navigator's actions in [-1, 1] and the velocities that they ask for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from vinl.policies.card import FORWARD_SPEED, YAW_RATE, PolicyCard


@dataclass(frozen=True)
class VelocityRange:
    """What -1 and 1 mean.

    Attributes:
        forward_speed: [m/s].
        yaw_rate: [rad/s].
    """

    forward_speed: Sequence[float] = FORWARD_SPEED
    yaw_rate: Sequence[float] = YAW_RATE

    @classmethod
    def of(cls, card: PolicyCard) -> VelocityRange:
        """What a navigator's card says; the usual range where it says nothing."""
        return cls(card.action.get("forward_speed", FORWARD_SPEED), card.action.get("yaw_rate", YAW_RATE))

    def velocity(self, action: Float[np.ndarray, "*n 2"]) -> Float[np.ndarray, "*n 2"]:
        """Forward speed [m/s] and yaw rate [rad/s] of an action."""
        middle, half = self._middle_and_half()
        return middle + half * action.astype(np.float64)

    def action(self, velocity: Float[np.ndarray, "*n 2"]) -> Float[np.ndarray, "*n 2"]:
        """The action that asks for a velocity, the nearest if it is out of range."""
        middle, half = self._middle_and_half()
        return np.clip((velocity - middle) / half, -1.0, 1.0).astype(np.float32)

    def _middle_and_half(self) -> tuple[Float[np.ndarray, "2"], Float[np.ndarray, "2"]]:
        low, high = np.array([self.forward_speed, self.yaw_rate]).T
        return (high + low) / 2, (high - low) / 2
