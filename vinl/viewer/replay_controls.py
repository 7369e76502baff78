"""The panel of a recording: a time slider, play and pause, and the episodes to choose from."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import viser

from vinl.viewer.requests import OpenEpisode, Pause, Request, Reset, Seek, SetPace, StepOnce
from vinl.viewer.session import PACES
from vinl.viewer.snapshot import Snapshot


class ReplayControls:
    """The panel of a recording.

    Args:
        gui: of a viser server.
        ask: puts a request into the session's queue.
        labels: of the episodes.
        number: of the one that is shown.
    """

    def __init__(
        self, gui: viser.GuiApi, ask: Callable[[Request], None], labels: Sequence[str], number: int, snapshot: Snapshot
    ) -> None:
        self._paused = snapshot.paused
        actions: dict[str, Callable[[], Request]] = {
            "Play / pause": lambda: Pause(not self._paused),
            "Step": StepOnce,
            "From the start": Reset,
        }
        self._time = gui.add_slider("Time [s]", 0.0, _end_of(snapshot), 0.04, 0.0)
        self._time.on_update(lambda event: ask(Seek(float(event.target.value))) if event.client is not None else None)
        buttons = gui.add_button_group("Recording", tuple(actions))
        buttons.on_click(lambda event: ask(actions[event.target.value]()))
        pace = gui.add_slider("Pace of time", PACES[0], PACES[1], 0.05, 1.0, marks=((1.0, "real time"),))
        pace.on_update(lambda event: ask(SetPace(float(event.target.value))))
        chosen = gui.add_dropdown("Episode", tuple(labels), initial_value=labels[number])
        chosen.on_update(lambda event: ask(OpenEpisode(labels.index(event.target.value))))
        for key, text, act in (
            ("P", "Play or pause", actions["Play / pause"]),
            ("N", "One step", StepOnce),
            ("R", "From the start", Reset),
        ):
            gui.add_command(text, hotkey=key).on_trigger(lambda _, act=act: ask(act()))  # type: ignore[arg-type]

    def follow(self, snapshot: Snapshot) -> None:
        """Show how far the recording is."""
        self._paused = snapshot.paused
        if self._time.max != _end_of(snapshot):
            self._time.max = _end_of(snapshot)
        self._time.value = round(min(snapshot.time_s, _end_of(snapshot)), 2)


def _end_of(snapshot: Snapshot) -> float:
    return max(round(snapshot.duration_s or 0.0, 2), 0.04)
