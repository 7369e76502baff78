"""Progress of a training: a bar with time left on a terminal, a line now and then elsewhere."""

from __future__ import annotations

import time
from types import TracebackType

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Column

_LINE_EVERY = 60.0
"""Seconds between lines when the output is no terminal."""

_SHOWN = 3
"""Figures in the bar: what fits into 80 columns."""

_FIRST = "compiling: a minute or two"


class TrainingProgress:
    """Shows iterations done, the time left and the first three figures; before the first iteration, that programs are
    compiled.

    Args:
        total: iterations of the whole run, or its seconds.
        done: of them before.
        unit: what is counted.
    """

    def __init__(self, total: int, done: int = 0, console: Console | None = None, unit: str = "iteration") -> None:
        self.console = console or Console(stderr=True)
        self._bar = Progress(
            TextColumn(unit + " {task.completed}/{task.total}", table_column=Column(no_wrap=True)),
            BarColumn(bar_width=4),
            TimeRemainingColumn(compact=True, table_column=Column(no_wrap=True)),
            TextColumn("left"),
            TextColumn("{task.fields[figures]}", table_column=Column(no_wrap=True, overflow="ellipsis")),
            console=self.console,
            disable=not self.console.is_terminal,
        )
        self._task = self._bar.add_task("", total=total, completed=done, figures=_FIRST)
        self._total, self._last, self._unit = total, -_LINE_EVERY, unit

    def __enter__(self) -> TrainingProgress:
        self._bar.start()
        if not self.console.is_terminal:
            self.console.print(_FIRST, highlight=False, soft_wrap=True)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._bar.stop()

    def show(self, iteration: int, figures: dict[str, str]) -> None:
        """Move on to ``iteration`` (or second)."""
        text = "  ".join(f"{name} {value}" for name, value in figures.items())
        shown = "  ".join(
            f"{value}/s" if name == "samples/s" else f"{name} {value}" for name, value in list(figures.items())[:_SHOWN]
        )
        self._bar.update(self._task, completed=iteration, figures=shown)
        now = time.monotonic()
        if not self.console.is_terminal and (now - self._last >= _LINE_EVERY or iteration == self._total):
            self._last = now
            self.console.print(f"{self._unit} {iteration}/{self._total}  {text}", highlight=False, soft_wrap=True)
