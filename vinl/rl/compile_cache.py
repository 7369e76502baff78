"""JAX keeps what it has compiled: the next start of the same training takes seconds."""

from __future__ import annotations

import hashlib
import os
import platform
from pathlib import Path


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
