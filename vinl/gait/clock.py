"""The gait clock: a phase a leg, for numpy, jax.numpy and torch alike (``xp``)."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from vinl.gait.arrays import constant
from vinl.gait.config import GaitConfig
from vinl.robot.aliengo import CONTROL_DT

OFFSETS = np.array([0.0, 0.5, 0.5, 0.0], np.float32)
"""(4,) phases of the legs in the order of ``LEGS``: a trot, diagonal legs together."""

TURN_ARM = 0.35
"""A yaw rate counts as this speed for each rad/s [m]: somewhat more than the distance from the trunk's middle to a
foot, 0.28 m, so that turns are walked in more than one step each."""

_FOLLOW = 0.15
"""Time constant with which the period follows the command [s]: a command that jumps must not tear a swing."""

STANDING = 0.05
"""Commands below this ask to stand [m/s, rad/s]."""


def wanted_period(xp: Any, config: GaitConfig, command: Any) -> Any:
    """(n,) the period that commands (n, 3) ask for [s]."""
    speed = xp.sqrt(command[:, 0] ** 2 + command[:, 1] ** 2 + (TURN_ARM * command[:, 2]) ** 2)
    low, high = config.period
    return xp.clip(config.stride / xp.clip(speed, 1e-3, None), low, high)


def follow_period(xp: Any, config: GaitConfig, period: Any, command: Any) -> Any:
    """(n,) the period one control step on [s]."""
    return period + (wanted_period(xp, config, command) - period) * (CONTROL_DT / _FOLLOW)


def swing_fraction(xp: Any, config: GaitConfig, period: Any) -> Any:
    """(n,) fraction of the period that a foot swings."""
    return xp.clip(config.swing_time / period, 0.0, config.swing_fraction)


def unison(xp: Any, phases: Any) -> Any:
    """(n, 4) how far each leg is ahead of the trot that fits all four best, in phases within half a period."""
    angle = 2 * math.pi * (phases - constant(xp, OFFSETS, phases))
    mean = xp.arctan2(xp.sin(angle).sum(-1), xp.cos(angle).sum(-1))[:, None]
    return ((angle - mean) / (2 * math.pi) + 0.5) % 1.0 - 0.5


def is_moving(xp: Any, command: Any) -> Any:
    """(n,) whether commands (n, 3) ask for more than standing."""
    return (xp.sqrt(command[:, 0] ** 2 + command[:, 1] ** 2) > STANDING) | (xp.abs(command[:, 2]) > STANDING)
