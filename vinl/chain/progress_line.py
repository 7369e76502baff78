"""A progress bar for calls from Python: on a terminal and in a notebook, and nowhere else."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib.util import find_spec

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn

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
