"""Homes built in the order of their seeds, in processes beside the training."""

from __future__ import annotations

import multiprocessing
import os
from collections import deque
from collections.abc import Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor
from itertools import repeat

from vinl.nav.config import NavConfig
from vinl.nav.home_builder import BuiltHome, build_home, build_plan

_FEW = 24
"""So few homes are built sooner in place than processes start."""


def count_workers(config: NavConfig, homes: int) -> int:
    """Processes that building so many homes is worth; 0: build in place."""
    wanted = config.homes.workers
    if wanted is None:
        wanted = (os.cpu_count() or 1) - 1 if homes > _FEW else 0
    return min(wanted, homes)


class HomeStream:
    """An endless row of homes, seed after seed.

    Args:
        config: of the environment.
        first: seed of the first home.
        workers: processes; 0: ``next`` builds in place.
    """

    def __init__(self, config: NavConfig, first: int, workers: int) -> None:
        self.config, self.workers = config, workers
        self._seed = first
        self._waiting: deque[Future[BuiltHome | str]] = deque()
        self._pool: ProcessPoolExecutor | None = None
        if workers > 0:
            # fresh processes: a fork of one that uses a GPU, or has threads, may hang
            self._pool = ProcessPoolExecutor(workers, multiprocessing.get_context("spawn"), initializer=_start_worker)

    def next(self) -> BuiltHome | str:
        """The home of the next seed, or why it has none; waits for it."""
        if self._pool is None:
            self._seed += 1
            return build_home(self._seed - 1, self.config)
        self._fill()
        return self._waiting.popleft().result()

    def take_ready(self) -> Iterator[BuiltHome | str]:
        """The homes that are finished, without waiting; none where nothing is built beside."""
        if self._pool is not None:
            self._fill()
            while self._waiting and self._waiting[0].done():
                yield self._waiting.popleft().result()
                self._fill()

    def close(self) -> None:
        """End the processes."""
        if self._pool is not None:
            self._pool.shutdown(wait=True, cancel_futures=True)
            self._pool = None
            self._waiting.clear()

    def _fill(self) -> None:
        assert self._pool is not None
        while len(self._waiting) < 4 * self.workers:
            self._waiting.append(self._pool.submit(build_home, self._seed, self.config))
            self._seed += 1


def build_plans(paths: Sequence[str], config: NavConfig, copies: int = 1) -> Iterator[BuiltHome | str]:
    """The homes of floor plans' files in their order, by several processes where there are many.

    Args:
        paths: each of one plan, see ``vinl.world.readers.expand_paths``.
        config: of the environment.
        copies: times that every plan is there, each with other goals.

    Returns:
        For each the home, or why there is none.
    """
    plans = [path for path in paths for _ in range(copies)]
    seeds = range(config.homes.seed, config.homes.seed + len(plans))
    workers = count_workers(config, len(plans))
    if workers == 0:
        yield from map(build_plan, plans, seeds, repeat(config))
        return
    with ProcessPoolExecutor(workers, multiprocessing.get_context("spawn"), initializer=_start_worker) as pool:
        yield from pool.map(build_plan, plans, seeds, repeat(config), chunksize=4)


def _start_worker() -> None:
    """A worker has no use for the GPU, and leaves an interrupt to the process that started it."""
    import signal

    os.environ["CUDA_VISIBLE_DEVICES"] = ""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
