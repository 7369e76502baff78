"""What a training needs of its machine: JAX keeps what it has compiled, so that the next start takes seconds; full
memory is one line that names the setting."""

from __future__ import annotations

import hashlib
import os
import platform
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from vinl.config.errors import InputError


def use_compile_cache() -> None:
    """Have JAX keep compiled programs in the user's cache folder; to call before JAX is imported. What the environment
    says (``JAX_COMPILATION_CACHE_DIR``) stays."""
    root = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    os.environ.setdefault("JAX_COMPILATION_CACHE_DIR", str(root / "vinl" / "jax" / _name_processor()))
    os.environ.setdefault("JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS", "0.5")


def _name_processor() -> str:
    """Compiled programs fit one kind of processor; a home folder may be shared by several."""
    info = Path("/proc/cpuinfo")
    lines = info.read_text().splitlines() if info.exists() else []
    kind = [line for line in lines if line.startswith(("flags", "model name"))][:2]
    return hashlib.sha256("\n".join([platform.machine(), *kind]).encode()).hexdigest()[:12]


_SIGNS = ("out of memory", "resource_exhausted", "failed to allocate", "cannot allocate memory")
"""What torch, JAX and Warp write when memory is full, in small letters."""


@contextmanager
def explain_out_of_memory(num_envs: int) -> Iterator[None]:
    """Turn the libraries' errors about full memory into one that says what to do.

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
