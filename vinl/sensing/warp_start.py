"""Start Warp without its chatter on the console."""

from __future__ import annotations

import contextlib
import ctypes
import os
from collections.abc import Iterator

import warp as wp

_LEVEL = 30
"""Warp's level "warnings and worse"; as a truth value it is Warp 1.18's ``quiet``."""


@contextlib.contextmanager
def _silent_stderr() -> Iterator[None]:
    """Warp's C++ part writes to file descriptor 2, past ``sys.stderr``."""
    try:
        kept = os.dup(2)
    except OSError:  # no stderr, nothing to silence
        yield
        return
    sink = os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(sink, 2)
        yield
    finally:
        os.dup2(kept, 2)
        os.close(kept)
        os.close(sink)


def _has_driver() -> bool:
    try:
        ctypes.CDLL("libcuda.so.1")
    except OSError:
        return False
    return True


def start_warp() -> None:
    """Initialise Warp once: no banner, no compile messages, no complaint about a missing GPU where there is none."""
    # Warp 1.19 knows log_level, Warp 1.18 quiet; each by its own name.
    setattr(wp.config, "log_level" if hasattr(wp.config, "log_level") else "quiet", _LEVEL)
    with contextlib.nullcontext() if _has_driver() else _silent_stderr():
        wp.init()
