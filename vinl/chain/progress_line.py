"""A progress bar for calls from Python: on a terminal and in a notebook, and nowhere else."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from tqdm import tqdm

_DELAY = 1.0
"""What takes less than this shows no bar [s]."""


def is_watched() -> bool:
    """Whether somebody sees what is written to the standard error: a terminal, or a notebook's cell."""
    return sys.stderr.isatty() or "ipykernel" in sys.modules


@contextmanager
def show_line(title: str, unit: str, total: float | None = None) -> Iterator[Callable[[float, float], None]]:
    """A bar with the time left; it is gone when the work is done.

    Args:
        title: what is going on.
        unit: of what is counted.
        total: of the work, or None if only a call tells.

    Yields:
        A function to call with how much is done, and of how much in all.
    """
    shape = "{desc}: {percentage:3.0f}%|{bar}| {n:.0f}/{total:.0f} {unit}, {elapsed} so far, {remaining} left"
    with tqdm(
        desc=title, unit=unit, total=total, disable=not is_watched(), leave=False, delay=_DELAY, ncols=80,
        bar_format=shape if total is not None else None,
    ) as bar:  # fmt: skip

        def show(done: float, of: float) -> None:
            bar.total = of
            bar.bar_format = shape
            bar.update(done - bar.n)

        yield show
