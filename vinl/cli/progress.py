"""The progress bar of an evaluation, with the time that is left."""

from __future__ import annotations

from datetime import timedelta
from types import TracebackType

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, ProgressColumn, Task, TaskID, TextColumn, TimeElapsedColumn
from rich.progress import Progress as Bar
from rich.text import Text

_TITLES = {"plan": "floor plans", "walk": "episodes", "film": "films", "robot": "robots", "crossing": "crossings"}

_LOST = "nothing was written"

_BAR = 24
"""Width of the bar: at 80 columns there is room for what stands beside it."""


class TimeLeft(ProgressColumn):
    """Time left, by how long the pieces of this session took on average.

    Episodes end in bursts, those that fail last: the speed of the last seconds, which rich goes by, says little.
    """

    def render(self, task: Task) -> Text:
        """The time as h:mm:ss, or dashes before the first piece is done."""
        done, elapsed = task.completed - task.fields.get("before", 0), task.elapsed
        if task.finished or task.total is None:
            return Text("0:00:00", style="progress.remaining")
        if done <= 0 or elapsed is None:
            return Text("-:--:--", style="progress.remaining")
        left = elapsed / done * (task.total - task.completed)
        return Text(str(timedelta(seconds=round(left))), style="progress.remaining")


class Progress:
    """A context that shows one bar for each kind of work. After Ctrl-C it says what was done.

    Args:
        console: where to.
        kept: what becomes of the work done when the run is interrupted.
        empty: the same where no piece of it was done.
    """

    def __init__(self, console: Console, kept: str = _LOST, empty: str = _LOST) -> None:
        self._console, self._kept, self._empty = console, kept, empty
        self._bar = Bar(
            TextColumn("{task.description:<12}"),
            BarColumn(_BAR),
            MofNCompleteColumn(),
            TimeElapsedColumn(),
            TextColumn("left"),
            TimeLeft(),
            TextColumn("{task.fields[note]}"),
            console=console,
        )
        self._tasks: dict[str, TaskID] = {}
        self._counts: dict[str, tuple[int, int]] = {}

    def show(self, what: str, done: int, total: int) -> None:
        """So many pieces of a kind of work are done; those of the first call were done before. Seconds stand beside the
        episodes: something moves while none has ended."""
        if what == "second":
            self._bar.update(self._tasks["walk"], note=f"{done} s walked")
            return
        if what not in self._tasks:
            self._tasks[what] = self._bar.add_task(_TITLES.get(what, what), total=total, before=done, note="")
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
            kept = self._kept if any(d for w, (d, _) in self._counts.items() if w != "plan") else self._empty
            self._console.print(f"stopped after {done or 'nothing'}; {kept}", soft_wrap=True)
