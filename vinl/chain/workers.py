"""Worker processes: each takes whole units of work; what they return does not depend on how many there are. And a
progress bar for calls from Python."""

from __future__ import annotations

import contextlib
import gc
import multiprocessing
import os
import pickle
import queue
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, ProcessPoolExecutor, wait
from contextlib import contextmanager
from dataclasses import dataclass, replace
from importlib.util import find_spec
from typing import Any, TypeVar

import torch
from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn

T = TypeVar("T")
POLL = 0.1
"""Seconds between two looks at the workers' messages."""
PATIENCE = 60.0
"""Seconds to wait for a message that a worker has sent."""


@dataclass(frozen=True)
class Context:
    """What a job gets beside its own arguments.

    Attributes:
        shared: what ``WorkerPool`` was made with.
        report: report one finished piece of work, and hand over what it gave, if anything.
        is_stopped: whether the user wants to stop.
    """

    shared: Any
    report: Callable[..., None]
    is_stopped: Callable[[], bool]


class WorkerPool:
    """Runs jobs ``work(context, job)`` in ``workers`` processes, or in this one if there is one worker.

    Torch uses one thread everywhere, so that sums are added in the same order in any process.

    Args:
        shared: handed to every job; unpickled once a process.
    """

    def __init__(self, workers: int, shared: Any) -> None:
        self._workers, self._shared = workers, shared
        self._pool: ProcessPoolExecutor | None = None

    def __enter__(self) -> WorkerPool:
        if self._workers > 1:
            # spawn, not fork: forked children of a process with torch's threads may hang
            context = multiprocessing.get_context("spawn")
            self._messages, self._stop = context.Queue(), context.Event()
            # Not among the arguments of a process: to hand over more than a pipe holds waits until the new process has
            # imported everything, and all would start one after the other. A queue has a thread for that.
            self._luggage = context.Queue()
            self._pool = ProcessPoolExecutor(
                self._workers, context, _start, (self._luggage, self._messages, self._stop)
            )
            packed = pickle.dumps(self._shared)
            for _ in range(self._workers):
                self._luggage.put(packed)
        return self

    def __exit__(self, kind: type[BaseException] | None, *rest: object) -> None:
        if self._pool is None:
            return
        if kind is not None:
            self._stop.set()
        self._pool.shutdown(wait=True, cancel_futures=True)
        for channel in (self._messages, self._luggage):
            channel.cancel_join_thread()
            channel.close()

    def run(self, work: Callable[[Context, Any], T], jobs: list[Any], on_piece: Callable[..., None]) -> list[T]:
        """All jobs; the answers in the order of the jobs. ``on_piece`` is called for each piece that a job reports,
        with what was handed over. Pieces of finished jobs have all been reported when this returns."""
        if self._pool is None:
            with one_thread():
                context = Context(self._shared, on_piece, lambda: False)
                return [work(context, job) for job in jobs]
        futures = [self._pool.submit(_run, work, job) for job in jobs]
        open_, heard = set(futures), 0
        while open_:
            done, open_ = wait(open_, timeout=POLL, return_when=FIRST_COMPLETED)
            heard += self._drain(on_piece)
            for future in done:
                future.result()  # the first failure ends it all
        answers, reported = zip(*(future.result() for future in futures), strict=True) if futures else ((), ())
        while heard < sum(reported):  # an answer may overtake the last messages
            on_piece(*self._messages.get(timeout=PATIENCE))
            heard += 1
        return list(answers)

    def _drain(self, on_piece: Callable[..., None]) -> int:
        heard = 0
        with contextlib.suppress(queue.Empty):
            while True:
                on_piece(*self._messages.get_nowait())
                heard += 1
        return heard


@contextlib.contextmanager
def one_thread() -> Iterator[None]:
    """Torch with one thread, and as before afterwards."""
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(before)


_context: Context | None = None


def _start(luggage: Any, messages: Any, stop: Any) -> None:
    """First thing in a worker. Ctrl-C reaches the whole group: only the parent answers it."""
    global _context
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    torch.set_num_threads(1)
    _context = Context(pickle.loads(luggage.get()), lambda *piece: messages.put(piece), stop.is_set)
    gc.freeze()  # all that was imported: the garbage collector need not look through it


def _end_with_parent() -> None:
    """A parent that is killed cannot tell its workers to stop: they would walk on for nobody."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def _run(work: Callable[[Context, Any], T], job: Any) -> tuple[T, int]:
    """The job's answer, and how many pieces it reported."""
    assert _context is not None
    reported, report = 0, _context.report

    def count(*piece: Any) -> None:
        nonlocal reported
        reported += 1
        report(*piece)

    return work(replace(_context, report=count), job), reported


_DELAY, _EVERY = 1.0, 0.1
"""What takes less than the first shows no bar; it is drawn again after the second [s]."""


def is_watched() -> bool:
    """Whether somebody sees what is written to the standard error: a terminal, or a notebook that has widgets."""
    return sys.stderr.isatty() or ("ipykernel" in sys.modules and find_spec("ipywidgets") is not None)


@contextmanager
def show_line(title: str, unit: str) -> Iterator[Callable[[float, float], None]]:
    """A bar with the time left; it is gone when the work is done.

    Args:
        title: what is going on.
        unit: of what is counted.

    Yields:
        A function to call with how much is done, and of how much in all.
    """
    if not is_watched():
        yield lambda done, of: None
        return
    count = TextColumn("{task.completed:.0f}/{task.total:.0f} " + unit)
    times = TimeElapsedColumn(), TextColumn("so far,"), TimeRemainingColumn(), TextColumn("left")
    # drawn at calls alone: a thread of its own would stand beside those that processes are forked from
    bar = Progress(
        TextColumn("{task.description}:"), TaskProgressColumn(), BarColumn(None), count, *times,
        console=Console(stderr=True, width=80), transient=True, auto_refresh=False,
    )  # fmt: skip
    task, due = bar.add_task(title), time.monotonic() + _DELAY

    def show(done: float, of: float) -> None:
        nonlocal due
        bar.update(task, completed=done, total=of)
        if time.monotonic() >= due:
            due = time.monotonic() + _EVERY
            bar.start()
            bar.refresh()

    try:
        yield show
    finally:
        bar.stop()
