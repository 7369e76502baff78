"""A session: a source that is stepped at the pace of time in a thread of its own, asked for things through a queue of
plain records; what it shows of one moment is a snapshot, which never changes afterwards."""

from __future__ import annotations

import queue
import threading
import time
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Protocol, runtime_checkable

import numpy as np
import torch
from jaxtyping import Float

from vinl.chain.navigators.base import Navigator
from vinl.config.errors import InputError
from vinl.policies.policy import Policy
from vinl.robot.cameras import Camera
from vinl.viewer.world import World


@dataclass(frozen=True)
class Request:
    """Something that a session is asked for."""


@dataclass(frozen=True)
class _AtPlace(Request):
    x: float
    y: float


@dataclass(frozen=True)
class Pause(Request):
    """Stop time, or let it go on."""

    paused: bool


class StepOnce(Request):
    """One step of the source (20 ms when live), then pause."""


@dataclass(frozen=True)
class SetPace(Request):
    """How fast time goes: 1 is real time, 0.1 a tenth of it."""

    pace: float


class Reset(Request):
    """Put the robot back to where it was last put down."""


class SetGoal(_AtPlace):
    """Walk to a point [m] with the navigator."""


@dataclass(frozen=True)
class Drive(Request):
    """Walk with this command: forward [m/s], yaw rate [rad/s], left positive. Ends a walk to a goal."""

    forward: float
    turn: float


@dataclass(frozen=True)
class Push(Request):
    """Change the trunk's velocity at once by so much [m/s], towards an angle from its heading [rad]."""

    speed: float
    angle: float


class PlaceRobot(_AtPlace):
    """Put the robot down at x, y [m], with its heading."""


class ToggleBlock(_AtPlace):
    """Take away the block at a point [m]; where there is none, put one down."""


@dataclass(frozen=True)
class ScatterClutter(Request):
    """Draw the clutter anew from a preset; ``none`` clears the floor."""

    preset: str


@dataclass(frozen=True)
class ChangePolicies(Request):
    """Other policies, or their names or folders; None keeps the one there is."""

    locomotion: str | Path | Policy | None = None
    navigation: str | Path | Navigator | None = None


@dataclass(frozen=True)
class OpenPlan(Request):
    """Another floor plan, by name or file."""

    plan: str


@dataclass(frozen=True)
class Seek(Request):
    """Go to a time of a recording [s]."""

    time: float


@dataclass(frozen=True)
class OpenEpisode(Request):
    """Show another episode of the folder."""

    number: int


@dataclass(frozen=True, eq=False)
class DepthImage:
    """What a depth camera sees [m], and the camera."""

    camera: Camera
    depth: Float[np.ndarray, "height width"]


@dataclass(frozen=True, eq=False)
class Footholds:
    """Where the feet are to come down in the world frame [m], as chosen on the map of the ground, and as read from
    depth images by the policy; legs in the order of ``LEGS``. None: there are none."""

    planned: Float[np.ndarray, "4 3"] | None = None
    predicted: Float[np.ndarray, "4 3"] | None = None


@dataclass(frozen=True, eq=False)
class Snapshot:
    """One moment of a session.

    Attributes:
        world: plan and clutter; another object when one of them changed.
        time_s: since the robot was last put down, or of a recording [s].
        state: standing, walking, driven, reached, fallen or recorded.
        qpos: (19,) generalised position.
        velocity: (3,) forward, left [m/s], yaw rate [rad/s] in the heading frame.
        command: (3,) the same as commanded.
        goal: (2,) where it shall go [m], or None.
        path: (k, 2) where the trunk has been, every 0.1 s [m].
        distance_m: length of that [m].
        contacts: (m, 5) the latest contacts with blocks, walls and furniture: time [s], index into ``contact.KINDS``,
            x, y, z [m].
        contact_steps: control steps with a contact of a foot, of a leg, of the trunk.
        feet: (4, 3) middles of the feet [m].
        foot_forces: (4,) size of the net contact force on each foot [N].
        images: what the depth cameras saw last, by name.
        footholds: where the feet are to come down.
        occupied: (o, 2) cells that something stands on by the navigation policy's grid [m]; another array where they
            change.
        duration_s: of a recording [s]; None: it is live.
        paused: whether time stands still.
        pace: wanted speed of time, 1 is real time.
        real_time: speed of time as measured over the last second.
        step_ms: what a control step cost on average over the last second [ms].
        notice: number and text of the latest thing that the session has to say.
    """

    world: World
    time_s: float
    state: str
    qpos: Float[np.ndarray, "19"]
    velocity: Float[np.ndarray, "3"]
    command: Float[np.ndarray, "3"]
    goal: Float[np.ndarray, "2"] | None
    path: Float[np.ndarray, "k 2"]
    distance_m: float
    contacts: Float[np.ndarray, "m 5"]
    contact_steps: tuple[int, int, int]
    feet: Float[np.ndarray, "4 3"]
    foot_forces: Float[np.ndarray, "4"]
    images: Mapping[str, DepthImage]
    footholds: Footholds = field(default_factory=Footholds)
    occupied: Float[np.ndarray, "o 2"] = field(default_factory=lambda: np.zeros((0, 2)))
    duration_s: float | None = None
    paused: bool = False
    pace: float = 1.0
    real_time: float = 0.0
    step_ms: float = 0.0
    notice: tuple[int, str] = (0, "")


PACES = (0.05, 4.0)
"""Slowest and fastest pace of time; 1 is real time."""

LOOK_EVERY = 0.25
"""Depth images are rendered anew this often, in seconds of the wall clock."""

_LATE = 0.1
"""A session that is later than this does not try to catch up [s]: time slows down instead of jumping."""

_IDLE = 0.05


@runtime_checkable
class Source(Protocol):
    """What a session steps, ``dt`` seconds at a time: a live robot, or a recording."""

    dt: float

    def apply(self, request: Request) -> str:
        """Do what is asked, and say what there is to say about it; ``InputError`` if it cannot be done."""
        ...

    def step(self) -> bool:
        """One step; whether time should stop after it."""
        ...

    def snapshot(self, look: bool) -> Snapshot:
        """The present moment, with depth images rendered anew if ``look``."""
        ...


class Session:
    """Steps a source at the pace of time; 1 is real time.

    The source is touched by the session's thread alone. Others ask through ``ask`` and read ``snapshot``, which is
    replaced as a whole after every step. ``error`` is what ended the session, if anything did.
    """

    def __init__(self, source: Source, pace: float = 1.0, paused: bool = False) -> None:
        self._source, self._requests = source, queue.SimpleQueue[Request]()
        self._pace, self._paused = _check_pace(pace), paused
        self._notice, self._looked = (0, ""), -LOOK_EVERY
        self._steps: deque[tuple[float, float]] = deque()  # when steps of the last second ended, and what they cost [s]
        self._closing = threading.Event()
        self._thread: threading.Thread | None = None
        self.error: BaseException | None = None
        self.snapshot = self._look(True)

    def start(self) -> Session:
        """Let time go, in a thread of its own."""
        self._thread = threading.Thread(target=self._run, name="vinl session", daemon=True)
        self._thread.start()
        return self

    def close(self) -> None:
        """End the thread."""
        self._closing.set()
        if self._thread is not None:
            self._thread.join()

    def ask(self, request: Request) -> None:
        """Put a request into the queue; it is answered between two steps."""
        self._requests.put(request)

    def advance(self, steps: int = 1) -> Snapshot:
        """Answer what was asked, then make so many steps at once, in the caller's thread: for sessions that were not
        started."""
        assert self._thread is None, "a session that runs steps itself"
        self._answer()
        for _ in range(steps):
            if self._paused:
                break
            self._step()
        self.snapshot = self._look(True)
        return self.snapshot

    # ---- the thread ------------------------------------------------------------------------------------------------

    def _run(self) -> None:
        torch.set_num_threads(1)  # holds for the calling thread: the networks are small, two cores are soon full
        due = time.perf_counter()
        try:
            while not self._closing.is_set():
                changed = self._answer()
                if self._paused:
                    stale = time.perf_counter() - self._looked > LOOK_EVERY
                    if changed or (stale and self.snapshot.paused is False):
                        self.snapshot = self._look(True)
                    self._closing.wait(_IDLE)
                    due = time.perf_counter()
                    continue
                self._step()
                self.snapshot = self._look(time.perf_counter() - self._looked > LOOK_EVERY)
                due = max(due + self._source.dt / self._pace, time.perf_counter() - _LATE)
                rest = due - time.perf_counter()
                if rest > 0:
                    self._closing.wait(rest)
        except Exception as error:  # whoever shows the session says what went wrong
            self.error = error
            self._say(str(error))
            self._paused = True
            self.snapshot = replace(self.snapshot, paused=True, notice=self._notice)

    def _step(self) -> None:
        began = time.perf_counter()
        if self._source.step():
            self._paused = True
        now = time.perf_counter()
        self._steps.append((now, now - began))
        while self._steps[0][0] < now - 1.0:
            self._steps.popleft()

    def _answer(self) -> bool:
        """Do what is in the queue; whether there was anything."""
        changed = False
        while True:
            try:
                request = self._requests.get_nowait()
            except queue.Empty:
                return changed
            changed = True
            try:
                self._do(request)
            except InputError as error:
                self._say(str(error))

    def _do(self, request: Request) -> None:
        match request:
            case Pause(paused):
                self._paused = paused
                self._steps.clear()
            case SetPace(pace):
                self._pace = _check_pace(pace)
                self._steps.clear()
            case StepOnce():
                self._paused = False
                self._step()
                self._paused = True
            case _:
                said = self._source.apply(request)
                if said:
                    self._say(said)
                if isinstance(request, Reset):
                    self._paused = False
                if not isinstance(request, Seek):
                    self._steps.clear()

    def _say(self, text: str) -> None:
        self._notice = self._notice[0] + 1, text

    def _look(self, look: bool) -> Snapshot:
        if look:
            self._looked = time.perf_counter()
        real_time, step_ms = self._measure()
        return replace(
            self._source.snapshot(look),
            paused=self._paused,
            pace=self._pace,
            real_time=real_time,
            step_ms=step_ms,
            notice=self._notice,
        )

    def _measure(self) -> tuple[float, float]:
        """Speed of time over the last second, and what a step cost [ms]."""
        if self._paused or len(self._steps) < 2:
            return 0.0, 0.0
        span = self._steps[-1][0] - self._steps[0][0]
        cost = sum(cost for _, cost in self._steps) / len(self._steps)
        return (len(self._steps) - 1) * self._source.dt / max(span, 1e-6), 1000 * cost


def _check_pace(pace: float) -> float:
    if not PACES[0] <= pace <= PACES[1]:
        raise InputError(f"the pace of time must lie between {PACES[0]:g} and {PACES[1]:g}, got {pace:g}")
    return pace
