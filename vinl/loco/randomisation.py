"""What a robot of the training is like: drawn for every episode, each number from a random state of its own."""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from vinl.config.limits import Range
from vinl.loco.config import RandomisationConfig
from vinl.robot.commands import UNIFORM, CommandConfig, make_commands


def uniform(key: Array, shape: tuple[int, ...], bounds: Range) -> Array:
    """Numbers drawn uniformly from a range."""
    return jax.random.uniform(key, shape, minval=bounds[0], maxval=bounds[1])


def draw_commands(config: CommandConfig, key: Array, n: int) -> tuple[Float[Array, "n 3"], Int[Array, " n"]]:
    """New commands of n robots, and control steps until the next ones, see ``make_commands``."""
    drawn = [jax.random.uniform(part, (n,)) for part in jax.random.split(key, len(UNIFORM))]
    return make_commands(jnp, config, jnp.stack(drawn, -1))


class Traits(NamedTuple):
    """What does not change in an episode.

    Attributes:
        friction: (n,) of the feet.
        added_mass: (n,) on the trunk [kg].
        kp, kd: (n,) factors of the joint gains.
        joint_friction: (n,) factor of the joints' dry friction and damping.
        latency: (n,) from an observation to its action's effect [s].
        angular_velocity_bias: (n, 3) of the gyroscope [rad/s].
        gravity_bias: (n, 3) of the direction of gravity.
    """

    friction: Float[Array, " n"]
    added_mass: Float[Array, " n"]
    kp: Float[Array, " n"]
    kd: Float[Array, " n"]
    joint_friction: Float[Array, " n"]
    latency: Float[Array, " n"]
    angular_velocity_bias: Float[Array, "n 3"]
    gravity_bias: Float[Array, "n 3"]


def draw_traits(config: RandomisationConfig, key: Array, n: int) -> Traits:
    """Traits of n robots."""
    keys = Traits(*jax.random.split(key, len(Traits._fields)))
    turn, tilt = config.angular_velocity_bias, config.gravity_bias
    return Traits(
        friction=uniform(keys.friction, (n,), config.friction),
        added_mass=uniform(keys.added_mass, (n,), config.added_mass),
        kp=uniform(keys.kp, (n,), config.kp_scale),
        kd=uniform(keys.kd, (n,), config.kd_scale),
        joint_friction=uniform(keys.joint_friction, (n,), config.joint_friction),
        latency=uniform(keys.latency, (n,), config.latency),
        angular_velocity_bias=uniform(keys.angular_velocity_bias, (n, 3), (-turn, turn)),
        gravity_bias=uniform(keys.gravity_bias, (n, 3), (-tilt, tilt)),
    )


def plain_traits(n: int) -> Traits:
    """Robots as the model describes them, on feet with friction 1."""
    ones, zeros = (jnp.ones(n) for _ in range(4)), (jnp.zeros(n) for _ in range(2))  # no two share their memory
    friction, kp, kd, joint_friction = ones
    added_mass, latency = zeros
    still = jnp.zeros((n, 3)), jnp.zeros((n, 3))
    return Traits(friction, added_mass, kp, kd, joint_friction, latency, *still)
