"""The bar of an evaluation: the time that is left, and what it says when it is stopped."""

import io

import pytest
from rich.console import Console
from rich.progress import Task

from vinl.cli.progress import Progress, TimeLeft


def make_task(done: int, before: int, elapsed: float) -> Task:
    """A task of ten pieces that has run for so many seconds."""
    now = [100.0]
    task = Task(0, "", 10, done, _get_time=lambda: now[0], fields={"before": before})  # type: ignore[arg-type]
    task.start_time = now[0]
    now[0] += elapsed
    return task


@pytest.mark.parametrize(
    ("done", "before", "elapsed", "left"),
    [(0, 0, 5.0, "-:--:--"), (2, 0, 60.0, "0:04:00"), (6, 4, 60.0, "0:02:00"), (4, 4, 9.0, "-:--:--")],
)
def test_time_left_goes_by_the_pieces_of_this_session(done: int, before: int, elapsed: float, left: str) -> None:
    assert TimeLeft().render(make_task(done, before, elapsed)).plain == left


def test_seconds_move_while_no_episode_has_ended() -> None:
    said = io.StringIO()
    with Progress(Console(file=said, width=80, force_terminal=True, color_system=None)) as progress:
        progress.show("plan", 0, 1)
        progress.show("walk", 0, 250)
        progress.show("second", 12345, 31250)
    last = [line for line in said.getvalue().splitlines() if "episodes" in line][-1]
    assert last.endswith("12345 s walked") and len(last) <= 80


def test_what_is_said_after_ctrl_c() -> None:
    console = Console(file=io.StringIO(), width=100)
    with pytest.raises(KeyboardInterrupt), Progress(console, "runs/a keeps them") as progress:
        progress.show("plan", 0, 1)
        progress.show("walk", 3, 10)
        raise KeyboardInterrupt
    assert "stopped after 3 of 10 episodes; runs/a keeps them" in console.file.getvalue()  # type: ignore[attr-defined]
    for more, said in (({}, "nothing was written"), ({"empty": "none in runs/b"}, "none in runs/b")):
        with pytest.raises(KeyboardInterrupt), Progress(console, "runs/b keeps them", **more) as progress:
            progress.show("plan", 0, 1)
            progress.show("walk", 0, 10)
            raise KeyboardInterrupt
        assert f"stopped after 0 of 10 episodes; {said}" in console.file.getvalue()  # type: ignore[attr-defined]
