"""Where the time of a training goes: measured now and then, because measuring makes the host wait for the device."""

from __future__ import annotations

import contextlib
import time
from collections import defaultdict
from collections.abc import Iterator

import torch


class Stopwatch:
    """Seconds by name, waiting for the device before and after each part while it runs.

    Attributes:
        running: whether it measures; otherwise ``part`` does nothing.
    """

    def __init__(self, device: str) -> None:
        self.running = False
        self._on_gpu = device.startswith("cuda")
        self._seconds: dict[str, float] = defaultdict(float)

    @contextlib.contextmanager
    def part(self, name: str) -> Iterator[None]:
        """Add the seconds of the block to ``name``."""
        if not self.running:
            yield
            return
        start = self._now()
        yield
        self._seconds[name] += self._now() - start

    def read(self) -> dict[str, float]:
        """Seconds by name since the last call; empty where nothing was measured."""
        seconds = dict(self._seconds)
        self._seconds.clear()
        return seconds

    def _now(self) -> float:
        if self._on_gpu:
            torch.cuda.synchronize()  # all streams of the device, JAX's and Warp's too
        return time.perf_counter()
