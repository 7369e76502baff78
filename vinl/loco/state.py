"""What the locomotion environment remembers of its robots, and how it is when an episode begins."""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from vinl.loco.commands import DRAWS, between, draw_commands
from vinl.loco.config import LocoConfig, RandomisationConfig
from vinl.loco.measures import MEASURES, TERMS
from vinl.loco.simulation import Body
from vinl.robot.aliengo import CONTROL_DT, DEFAULT_POSE


class State(NamedTuple):
    """Everything that changes, one row a robot. It is saved with every checkpoint.

    Attributes:
        key: random state.
        body: physics.
        action: (n, 12) last one.
        command: (n, 3); command_left: (n,) steps until the next.
        push_left: (n,) steps until the next push.
        step: (n,) of the episode, from a random one at first; life: (n,) steps since the start, -1 where the
            observation is not finite.
        air_time: (n, 4) [s]; touched: (n, 4) feet on the ground in the last step.
        way, commanded: (n,) progress along the commands and what they asked for [m].
        hits: (n,) steps of the episode with a foot or shank on a block.
        level, column: (n,) tile.
        friction, added_mass: (n,) of the robot.
        sums: (m,) of ``MEASURES`` and of the reward terms since they were last read.
    """

    key: Array
    body: Body
    action: Float[Array, "n 12"]
    command: Float[Array, "n 3"]
    command_left: Int[Array, " n"]
    push_left: Int[Array, " n"]
    step: Int[Array, " n"]
    life: Int[Array, " n"]
    air_time: Float[Array, "n 4"]
    touched: Bool[Array, "n 4"]
    way: Float[Array, " n"]
    commanded: Float[Array, " n"]
    hits: Float[Array, " n"]
    level: Int[Array, " n"]
    column: Int[Array, " n"]
    friction: Float[Array, " n"]
    added_mass: Float[Array, " n"]
    sums: Float[Array, " m"]


def count_steps(config: LocoConfig) -> int:
    """Control steps of an episode that runs out of time."""
    return round(config.episode_length / CONTROL_DT)


def start_body(
    randomisation: RandomisationConfig,
    starts: Float[Array, "levels columns 3"],
    level: Int[Array, " n"],
    column: Int[Array, " n"],
    u: Float[Array, "n 22"],
) -> Body:
    """Robots near the middle of their tiles, any heading, joints and velocities a little off.

    Args:
        randomisation: how far off.
        starts: middles of the tiles and the ground's height there [m].
        level, column: tile of each robot.
        u: random numbers in [0, 1).
    """
    c, n, s = randomisation, len(u), 2 * u - 1
    middle, yaw, zero = starts[level, column], s[:, 2] * jnp.pi, jnp.zeros(n)
    qpos = jnp.concatenate(
        [
            middle[:, :2] + s[:, :2] * c.start_xy,
            middle[:, 2:] + c.start_height,
            jnp.stack([jnp.cos(yaw / 2), zero, zero, jnp.sin(yaw / 2)], 1),
            jnp.asarray(DEFAULT_POSE, jnp.float32) * (1 + c.start_joints * s[:, 3:15]),
        ],
        1,
    )
    qvel = jnp.concatenate([c.start_velocity * s[:, 15:21], jnp.zeros((n, 12))], 1)
    return Body(qpos, qvel, jnp.zeros((n, 18)))


def first_state(config: LocoConfig, starts: Float[Array, "levels columns 3"], key: Array) -> State:
    """All robots at the start of a training, each a random while into its episode.

    Args:
        config: of the training.
        starts: as for ``start_body``.
        key: random state.
    """
    c, n = config, config.num_envs
    key, draw = jax.random.split(key)
    u = jax.random.uniform(draw, (n, 40))
    highest = min(c.curriculum.first_level, c.terrain.levels - 1)
    level = (u[:, 30] * (highest + 1)).astype(jnp.int32)
    column = (jnp.arange(n) % c.terrain.columns).astype(jnp.int32)
    command, left = draw_commands(c.commands, u[:, 22 : 22 + DRAWS])
    state = State(
        key=key,
        body=start_body(c.randomisation, starts, level, column, u[:, :22]),
        action=jnp.zeros((n, 12)),
        command=command,
        command_left=left,
        push_left=(u[:, 31] * c.randomisation.push_interval / CONTROL_DT).astype(jnp.int32),
        step=(u[:, 32] * count_steps(c)).astype(jnp.int32),
        life=jnp.zeros(n, jnp.int32),
        air_time=jnp.zeros((n, 4)),
        touched=jnp.zeros((n, 4), bool),
        way=jnp.zeros(n),
        commanded=jnp.zeros(n),
        hits=jnp.zeros(n),
        level=level,
        column=column,
        friction=between(c.randomisation.friction, u[:, 33]),
        added_mass=between(c.randomisation.added_mass, u[:, 34]),
        sums=jnp.zeros(len(MEASURES) + len(TERMS)),
    )
    return strip_weak_types(state)


def strip_weak_types(state: State) -> State:
    """No weak types: with them the step would compile twice."""
    return jax.tree.map(lambda x: x.astype(x.dtype), state)
