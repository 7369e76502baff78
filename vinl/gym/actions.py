"""Actions in [-1, 1] and what they ask of the robot."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from vinl.config.errors import InputError
from vinl.robot.aliengo import DEFAULT_POSE

JOINT_REACH = 4.0
"""Joint target = default pose + this x action [rad]. Holds what the shipped locomotors ask for: up to 3.4 rad, far
beyond where the joints get, for a target is the way to ask for a torque."""


def joint_target_of(action: Float[np.ndarray, "12"], reach: float) -> Float[np.ndarray, "12"]:
    """Joint targets [rad]: the default pose, and ``reach`` [rad] for an action of 1."""
    return DEFAULT_POSE + reach * action.astype(np.float64)


def check_action(action: np.ndarray, size: int) -> Float[np.ndarray, " n"]:
    """An action of so many numbers, held to [-1, 1].

    Raises:
        InputError: another shape, or numbers that are not finite.
    """
    found = np.asarray(action, dtype=np.float32)
    if found.shape != (size,):
        raise InputError(f"an action of this environment has shape ({size},), got {found.shape}")
    if not np.isfinite(found).all():
        raise InputError("an action must be finite, got NaN or infinite")
    return found.clip(-1.0, 1.0)
