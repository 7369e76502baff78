"""Velocity commands of the training: drawn uniformly, held for a while."""

from __future__ import annotations

import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from vinl.loco.config import CommandConfig
from vinl.robot.aliengo import CONTROL_DT

DRAWS = 5
"""Uniform numbers that one command takes."""


def between(bounds: tuple[float, float], u: Array) -> Array:
    """Uniform numbers in [0, 1) stretched to a range."""
    return bounds[0] + (bounds[1] - bounds[0]) * u


def draw_commands(config: CommandConfig, u: Float[Array, "n 5"]) -> tuple[Float[Array, "n 3"], Int[Array, " n"]]:
    """New commands.

    Args:
        config: the ranges.
        u: (n, 5) uniform in [0, 1).

    Returns:
        (n, 3) forward, left [m/s] and yaw rate [rad/s]; (n,) control steps until the next command.
    """
    forward = between(config.forward, u[:, 0])
    plane = jnp.stack([forward, between(config.left, u[:, 1])], 1)
    plane = jnp.where(jnp.linalg.norm(plane, axis=1, keepdims=True) > config.min_speed, plane, 0.0)
    turn = between(config.yaw_rate, u[:, 2:3])
    stand = u[:, 4:5] < config.stand_share
    spin = u[:, 4:5] < config.stand_share + config.turn_share
    command = jnp.concatenate([jnp.where(spin, 0.0, plane), jnp.where(stand, 0.0, turn)], 1)
    return command, (between(config.hold, u[:, 3]) / CONTROL_DT).astype(jnp.int32)
