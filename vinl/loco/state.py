"""What the locomotion environment remembers of its robots, and how it is when an episode begins."""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from vinl.gait.state import GaitState
from vinl.loco.config import LocoConfig, RandomisationConfig
from vinl.loco.measures import MEASURES, TERMS
from vinl.loco.randomisation import Traits, draw_commands, draw_traits, uniform
from vinl.loco.simulation import PAST, Body
from vinl.loco.walking import begin_gait
from vinl.robot.aliengo import CONTROL_DT, DEFAULT_POSE


class EnvState(NamedTuple):
    """Everything that changes, one row a robot. It is saved with every checkpoint.

    Attributes:
        key: random state.
        body: physics.
        action: (n, 12) last one.
        targets: (n, past, 12) joint targets, the newest first [rad].
        gait: clock, paths and footholds.
        command: (n, 3); command_left: (n,) steps until the next.
        push_left: (n,) steps until the next push.
        step: (n,) of the episode, from a random one at first; life: (n,) steps since the start, -1 where the
            observation is not finite.
        touched: (n, 4) feet on the ground in the last step; flying: (n, 4) feet that have not touched since.
        touching: (n, 16) feet and shanks on anything, feet and shanks on blocks in the last step, for the critic.
        velocity_error: (n, 3) of the observed base velocity [m/s].
        way, commanded: (n,) progress along the commands and what they asked for [m].
        hits: (n,) steps of the episode with a foot or shank on a block.
        level, column: (n,) tile.
        traits: of the robots.
        sums: (m,) of ``MEASURES`` and of the reward terms since they were last read.
    """

    key: Array
    body: Body
    action: Float[Array, "n 12"]
    targets: Float[Array, "n past 12"]
    gait: GaitState
    command: Float[Array, "n 3"]
    command_left: Int[Array, " n"]
    push_left: Int[Array, " n"]
    step: Int[Array, " n"]
    life: Int[Array, " n"]
    touched: Bool[Array, "n 4"]
    flying: Bool[Array, "n 4"]
    touching: Bool[Array, "n 16"]
    velocity_error: Float[Array, "n 3"]
    way: Float[Array, " n"]
    commanded: Float[Array, " n"]
    hits: Float[Array, " n"]
    level: Int[Array, " n"]
    column: Int[Array, " n"]
    traits: Traits
    sums: Float[Array, " m"]


class Episode(NamedTuple):
    """What begins with an episode: fields of ``EnvState``."""

    body: Body
    targets: Float[Array, "n past 12"]
    gait: GaitState
    velocity_error: Float[Array, "n 3"]
    traits: Traits


def count_steps(config: LocoConfig) -> int:
    """Control steps of an episode that runs out of time."""
    return round(config.episode_length / CONTROL_DT)


def start_body(
    randomisation: RandomisationConfig,
    starts: Float[Array, "levels columns 3"],
    level: Int[Array, " n"],
    column: Int[Array, " n"],
    key: Array,
) -> Body:
    """Robots near the middle of their tiles, any heading, joints and velocities a little off.

    Args:
        starts: middles of the tiles and the ground's height there [m].
        level, column: tile of each robot.
        key: random state.
    """
    c, n, (of_place, of_yaw, of_joints, of_velocity) = randomisation, len(level), jax.random.split(key, 4)
    middle, yaw, zero = starts[level, column], uniform(of_yaw, (n,), (-jnp.pi, jnp.pi)), jnp.zeros(n)
    qpos = jnp.concatenate(
        [
            middle[:, :2] + uniform(of_place, (n, 2), (-c.start_xy, c.start_xy)),
            middle[:, 2:] + c.start_height,
            jnp.stack([jnp.cos(yaw / 2), zero, zero, jnp.sin(yaw / 2)], 1),
            jnp.asarray(DEFAULT_POSE, jnp.float32) * uniform(of_joints, (n, 12), _about(1.0, c.start_joints)),
        ],
        1,
    )
    velocity = uniform(of_velocity, (n, 6), _about(0.0, c.start_velocity))
    return Body(qpos, jnp.concatenate([velocity, jnp.zeros((n, 12))], 1), jnp.zeros((n, 18)))


def _about(middle: float, spread: float) -> tuple[float, float]:
    return middle - spread, middle + spread


def begin_episode(
    config: LocoConfig,
    starts: Float[Array, "levels columns 3"],
    level: Int[Array, " n"],
    column: Int[Array, " n"],
    key: Array,
) -> Episode:
    """All robots at a start; arguments as for ``start_body``."""
    c, n, (of_body, of_traits, of_error) = config.randomisation, len(level), jax.random.split(key, 3)
    body = start_body(c, starts, level, column, of_body)
    return Episode(
        body=body,
        targets=jnp.tile(jnp.asarray(DEFAULT_POSE, jnp.float32), (n, PAST, 1)),
        gait=begin_gait(config.gait, body),
        velocity_error=c.velocity_bias * jax.random.normal(of_error, (n, 3)),
        traits=draw_traits(c, of_traits, n),
    )


def first_state(config: LocoConfig, starts: Float[Array, "levels columns 3"], key: Array) -> EnvState:
    """All robots at the start of a training, each a random while into its episode.

    Args:
        starts: as for ``start_body``.
        key: random state.
    """
    c, n = config, config.num_envs
    own, of_episode, of_command, of_level, of_push, of_step = jax.random.split(key, 6)
    highest = min(c.curriculum.first_level, c.terrain.levels - 1)
    level = jax.random.randint(of_level, (n,), 0, highest + 1)
    column = (jnp.arange(n) % c.terrain.columns).astype(jnp.int32)
    command, left = draw_commands(c.commands, of_command, n)
    start = begin_episode(c, starts, level, column, of_episode)
    state = EnvState(
        key=own,
        body=start.body,
        action=jnp.zeros((n, 12)),
        targets=start.targets,
        gait=start.gait,
        command=command,
        command_left=left,
        push_left=(uniform(of_push, (n,), (0.0, c.randomisation.push_interval)) / CONTROL_DT).astype(jnp.int32),
        step=jax.random.randint(of_step, (n,), 0, count_steps(c)),
        life=jnp.zeros(n, jnp.int32),
        touched=jnp.zeros((n, 4), bool),
        flying=jnp.zeros((n, 4), bool),
        touching=jnp.zeros((n, 16), bool),
        velocity_error=start.velocity_error,
        way=jnp.zeros(n),
        commanded=jnp.zeros(n),
        hits=jnp.zeros(n),
        level=level,
        column=column,
        traits=start.traits,
        sums=jnp.zeros(len(MEASURES) + len(TERMS)),
    )
    return strip_weak_types(state)


def strip_weak_types(state: EnvState) -> EnvState:
    """No weak types: with them the step would compile twice."""
    return jax.tree.map(lambda x: x.astype(x.dtype), state)
