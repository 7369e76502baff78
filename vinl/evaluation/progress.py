"""The progress bar of an evaluation, with the time that is left."""

from __future__ import annotations

from types import TracebackType

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, TaskID, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from rich.progress import Progress as Bar

_TITLES = {"plan": "floor plans", "walk": "episodes", "film": "films", "robot": "robots"}


class Progress:
    """A context that shows one bar for each kind of work. After Ctrl-C it says what was done."""

    def __init__(self, console: Console) -> None:
        self._console = console
        self._bar = Bar(
            TextColumn("{task.description:<12}"),
            BarColumn(),
            MofNCompleteColumn(),
            TimeElapsedColumn(),
            TextColumn("left"),
            TimeRemainingColumn(),
            console=console,
        )
        self._tasks: dict[str, TaskID] = {}
        self._counts: dict[str, tuple[int, int]] = {}

    def show(self, what: str, done: int, total: int) -> None:
        """So many pieces of a kind of work are done."""
        if what not in self._tasks:
            self._tasks[what] = self._bar.add_task(_TITLES.get(what, what), total=total)
        self._counts[what] = done, total
        # the bar counts plans before each is looked at, the others after each piece
        self._bar.update(self._tasks[what], completed=done + (what == "plan"))

    def __enter__(self) -> Progress:
        self._bar.start()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, tb: TracebackType | None) -> None:
        self._bar.stop()
        if kind is KeyboardInterrupt:
            done = ", ".join(f"{d} of {t} {_TITLES.get(w, w)}" for w, (d, t) in self._counts.items() if w != "plan")
            self._console.print(f"stopped after {done or 'nothing'}; nothing was written")
