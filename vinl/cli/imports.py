"""Large libraries are imported without the garbage collector."""

from __future__ import annotations

import gc
import sys
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def kept_imports() -> Iterator[None]:
    """What is imported inside stays until the process ends: the garbage collector never looks through it.

    Torch, JAX and Warp make a million objects, and JAX collects often while it traces: a quarter of all the time until
    a training runs.
    """
    before, was_enabled = len(sys.modules), gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if len(sys.modules) > before:  # else nothing of these libraries is new: what lies about is someone else's
            gc.freeze()
        if was_enabled:
            gc.enable()
