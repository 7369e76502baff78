"""The panels of a live session and of a recording: what one can press, slide and type. A control only asks the
session for something."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
import viser

from vinl.chain.navigators.base import Navigator
from vinl.policies.policy import Policy
from vinl.viewer.session import (
    PACES,
    ChangePolicies,
    Drive,
    OpenEpisode,
    OpenPlan,
    Pause,
    PlaceRobot,
    Push,
    Request,
    Reset,
    ScatterClutter,
    Seek,
    SetGoal,
    SetPace,
    Snapshot,
    StepOnce,
    ToggleBlock,
)
from vinl.world.clutter import CLUTTER

FORWARD, TURN = (-0.3, 1.0), 60.0
"""Commands that the sliders reach: forward [m/s], and to both sides [deg/s]."""

CLICKS: dict[str, Callable[[float, float], Request]] = {"goal": SetGoal, "block": ToggleBlock, "robot": PlaceRobot}
"""What a click on the floor asks for."""

CLICK_TEXTS = {"sets the goal": "goal", "puts down or takes away a block": "block", "puts the robot there": "robot"}

_FASTER, _TURN_MORE = 0.1, 10.0
"""What a press of a key adds: [m/s], [deg/s]."""

_KEYS = "Keys: `I` faster, `K` slower, `J` left, `L` right, `O` stop; `P` pause, `N` step, `R` reset, `H` push"


class Controls:
    """The panel of a live session. ``plans``, ``locomotion`` and ``navigation`` are what can be chosen, the present one
    first; ``ask`` puts a request into the session's queue."""

    def __init__(
        self,
        gui: viser.GuiApi,
        ask: Callable[[Request], None],
        plans: Sequence[str],
        locomotion: Mapping[str, str | Policy],
        navigation: Mapping[str, str | Navigator],
        obstacles: str,
    ) -> None:
        self._gui, self._ask, self._paused = gui, ask, False
        self._rng = np.random.default_rng(0)
        self._add_time()
        self._click: Any = gui.add_dropdown("A click on the floor", tuple(CLICK_TEXTS), hint="Shift + click: a block")
        self._add_drive()
        self._add_clutter(obstacles)
        self._add_choices(plans, locomotion, navigation)
        self._add_keys()

    @property
    def click(self) -> str:
        """What a click on the floor asks for: a key of ``CLICKS``."""
        return CLICK_TEXTS[self._click.value]

    def follow(self, snapshot: Snapshot) -> None:
        """Show what the session did by itself: pauses, commands of the navigator."""
        self._paused = snapshot.paused
        driven = bool(self._forward.value or self._turn.value)
        if snapshot.state in ("walking", "reached", "fallen") and driven:
            self._forward.value, self._turn.value = 0.0, 0.0

    def _add_time(self) -> None:
        actions: dict[str, Callable[[], Request]] = {
            "Pause": lambda: Pause(not self._paused),
            "Step": StepOnce,
            "Reset": Reset,
            "Push": self._draw_push,
        }
        buttons = self._gui.add_button_group(
            "Time",
            tuple(actions),
            hint="Pause or go on; one step of 20 ms; stand up again at the start; a push from the side",
        )
        buttons.on_click(lambda event: self._ask(actions[event.target.value]()))
        pace = self._gui.add_slider("Pace of time", PACES[0], 2.0, 0.05, 1.0, marks=((1.0, "real time"),))
        pace.on_update(lambda event: self._ask(SetPace(float(event.target.value))))
        self._push = self._gui.add_slider("Push [m/s]", 0.1, 1.5, 0.1, 0.6, hint="Change of the trunk's velocity")

    def _draw_push(self) -> Push:
        return Push(float(self._push.value), float(self._rng.choice([-1.0, 1.0])) * math.pi / 2)

    def _add_drive(self) -> None:
        with self._gui.add_folder("Drive"):
            self._forward = self._gui.add_slider("Forward [m/s]", *FORWARD, 0.05, 0.0)
            self._turn = self._gui.add_slider("Turn [deg/s]", -TURN, TURN, 5.0, 0.0, hint="Left positive")
            stop = self._gui.add_button("Stop", icon=viser.Icon.HAND_STOP)
            self._gui.add_markdown(f"<small>{_KEYS}</small>")
        for slider in (self._forward, self._turn):
            slider.on_update(lambda event: self._drive() if event.client is not None else None)
        stop.on_click(lambda _: self._set_drive(0.0, 0.0))

    def _drive(self) -> None:
        self._ask(Drive(float(self._forward.value), math.radians(float(self._turn.value))))

    def _set_drive(self, forward: float, turn: float) -> None:
        self._forward.value = float(np.clip(round(forward, 2), *FORWARD))
        self._turn.value = float(np.clip(turn, -TURN, TURN))
        self._drive()

    def _add_clutter(self, obstacles: str) -> None:
        with self._gui.add_folder("Clutter"):
            preset = self._gui.add_dropdown("Preset", tuple(CLUTTER), initial_value=obstacles)
            buttons = self._gui.add_button_group("Blocks", ("Draw anew", "Clear"))
        preset.on_update(lambda event: self._ask(ScatterClutter(event.target.value)))
        buttons.on_click(
            lambda event: self._ask(ScatterClutter(preset.value if event.target.value == "Draw anew" else "none"))
        )

    def _add_choices(
        self, plans: Sequence[str], locomotion: Mapping[str, str | Policy], navigation: Mapping[str, str | Navigator]
    ) -> None:
        with self._gui.add_folder("Robot and home", expand_by_default=False):
            if plans:
                plan = self._gui.add_dropdown("Floor plan", tuple(plans))
                plan.on_update(lambda event: self._ask(OpenPlan(event.target.value)))
            legs = self._gui.add_dropdown("Locomotion policy", tuple(locomotion))
            guide = self._gui.add_dropdown("Navigation policy", tuple(navigation))
        legs.on_update(lambda event: self._ask(ChangePolicies(locomotion=locomotion[event.target.value])))
        guide.on_update(lambda event: self._ask(ChangePolicies(navigation=navigation[event.target.value])))

    def _add_keys(self) -> None:
        def add(key: Any, text: str, act: Callable[[], Any]) -> None:
            self._gui.add_command(text, hotkey=key).on_trigger(lambda _: act())

        add("I", "Faster", lambda: self._set_drive(self._forward.value + _FASTER, self._turn.value))
        add("K", "Slower", lambda: self._set_drive(self._forward.value - _FASTER, self._turn.value))
        add("J", "Turn left", lambda: self._set_drive(self._forward.value, self._turn.value + _TURN_MORE))
        add("L", "Turn right", lambda: self._set_drive(self._forward.value, self._turn.value - _TURN_MORE))
        add("O", "Stop", lambda: self._set_drive(0.0, 0.0))
        add("P", "Pause or go on", lambda: self._ask(Pause(not self._paused)))
        add("N", "One step", lambda: self._ask(StepOnce()))
        add("R", "Reset", lambda: self._ask(Reset()))
        add("H", "Push", lambda: self._ask(self._draw_push()))


class ReplayControls:
    """The panel of a recording; ``number`` is the episode that is shown."""

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
