"""Velocity commands of the training: drawn uniformly, held for a while."""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from vinl.loco.config import CommandConfig
from vinl.loco.randomisation import split_by_name, uniform
from vinl.robot.aliengo import CONTROL_DT


class CommandKeys(NamedTuple):
    """Random states that commands are drawn from; ``kind`` decides between walking, turning and standing."""

    forward: Array
    left: Array
    yaw_rate: Array
    hold: Array
    kind: Array


def draw_commands(config: CommandConfig, key: Array, n: int) -> tuple[Float[Array, "n 3"], Int[Array, " n"]]:
    """New commands of n robots.

    Args:
        config: the ranges.
        key: random state.
        n: how many.

    Returns:
        (n, 3) forward, left [m/s] and yaw rate [rad/s]; (n,) control steps until the next command.
    """
    keys = split_by_name(CommandKeys, key)
    plane = jnp.stack([uniform(keys.forward, (n,), config.forward), uniform(keys.left, (n,), config.left)], 1)
    plane = jnp.where(jnp.linalg.norm(plane, axis=1, keepdims=True) > config.min_speed, plane, 0.0)
    turn = uniform(keys.yaw_rate, (n, 1), config.yaw_rate)
    kind = jax.random.uniform(keys.kind, (n, 1))
    stand = kind < config.stand_share
    spin = kind < config.stand_share + config.turn_share
    command = jnp.concatenate([jnp.where(spin, 0.0, plane), jnp.where(stand, 0.0, turn)], 1)
    return command, (uniform(keys.hold, (n,), config.hold) / CONTROL_DT).astype(jnp.int32)
