"""Levels of difficulty: up when a robot made good way along its commands, down when it did not."""

from __future__ import annotations

import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from vinl.loco.config import CurriculumConfig


def next_levels(
    config: CurriculumConfig,
    levels: int,
    level: Int[Array, " n"],
    timeout: Bool[Array, " n"],
    fallen: Bool[Array, " n"],
    way: Float[Array, " n"],
    commanded: Float[Array, " n"],
    life: Float[Array, " n"],
    u: Float[Array, " n"],
    contacts: Float[Array, " n"] | float = 0.0,
) -> Int[Array, " n"]:
    """The levels after an episode.

    Args:
        level: (n,) now.
        timeout, fallen: (n,) how the episode ended; robots with neither keep their level.
        way: (n,) progress along the command [m].
        commanded: (n,) way that the commands asked for [m].
        life: (n,) fraction of the whole episode that was lived, in (0, 1].
        u: (n,) uniform in [0, 1): those beyond the last level go to a random one [ViNL code].
        contacts: (n,) control steps with a foot or shank on a block.

    Returns:
        (n,) new levels.
    """
    asked = jnp.where(fallen, commanded / life, commanded)  # a fall is held to the whole episode
    counted = asked > config.min_way
    up = timeout & counted & (way > config.promote * commanded)
    if config.max_contacts is not None:
        up &= contacts <= config.max_contacts * way
    down = (timeout | fallen) & counted & (way < config.demote * asked)
    new = level + up.astype(jnp.int32) - down.astype(jnp.int32)
    return jnp.where(new >= levels, (u * levels).astype(jnp.int32), jnp.maximum(new, 0))
