"""The first state of an environment's robots, traced once for each environment: MJX aside, it takes longest."""

import functools
from collections.abc import Callable

import jax
from jax import Array

from vinl.loco.environment import LocoEnvironment
from vinl.loco.state import EnvState


@functools.cache
def first_state(env: LocoEnvironment) -> Callable[[Array], EnvState]:
    """From a random key, as the environment draws it."""
    return jax.jit(env._first_state)
