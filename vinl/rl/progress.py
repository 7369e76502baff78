"""Progress of a training: a bar with time left on a terminal, a line now and then elsewhere."""

from __future__ import annotations

import time
from types import TracebackType

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

_LINE_EVERY = 15.0
"""Seconds between lines when the output is no terminal."""


class TrainingProgress:
    """Shows iterations done, the time left and a few figures.

    Args:
        total: iterations of the whole run, or its seconds.
        done: of them before.
    """

    def __init__(self, total: int, done: int = 0, console: Console | None = None) -> None:
        self.console = console or Console(stderr=True)
        self._bar = Progress(
            TextColumn("[bold]training"),
            BarColumn(),
            MofNCompleteColumn(),
            TimeElapsedColumn(),
            TextColumn("left"),
            TimeRemainingColumn(),
            TextColumn("{task.fields[figures]}"),
            console=self.console,
            disable=not self.console.is_terminal,
        )
        self._task = self._bar.add_task("", total=total, completed=done, figures="")
        self._total, self._last = total, 0.0

    def __enter__(self) -> TrainingProgress:
        self._bar.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._bar.stop()

    def show(self, iteration: int, figures: dict[str, str]) -> None:
        """Move on to ``iteration`` (or second)."""
        text = "  ".join(f"{name} {value}" for name, value in figures.items())
        self._bar.update(self._task, completed=iteration, figures=text)
        now = time.monotonic()
        if not self.console.is_terminal and (now - self._last > _LINE_EVERY or iteration == self._total):
            self._last = now
            self.console.print(f"{iteration}/{self._total}  {text}", highlight=False, soft_wrap=True)
