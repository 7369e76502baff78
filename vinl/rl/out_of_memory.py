"""A training that does not fit into the device's memory: one line that names the setting."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from vinl.config.errors import InputError

_SIGNS = ("out of memory", "resource_exhausted", "failed to allocate", "cannot allocate memory")
"""What torch, JAX and Warp write when memory is full, in small letters."""


@contextmanager
def explain_out_of_memory(num_envs: int) -> Iterator[None]:
    """Turn the libraries' errors about full memory into one that says what to do.

    Args:
        num_envs: robots of the training.

    Raises:
        InputError: memory is full.
    """
    try:
        yield
    except (RuntimeError, MemoryError) as error:
        if not isinstance(error, MemoryError) and not any(sign in str(error).lower() for sign in _SIGNS):
            raise
        raise InputError(
            f"{num_envs} robots do not fit into the device's memory; give fewer, for example --num-envs "
            f"{max(num_envs // 2, 1)} (num_envs={max(num_envs // 2, 1)})"
        ) from error
