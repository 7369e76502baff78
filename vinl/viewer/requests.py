"""What can be asked of a session from outside: plain records that go through its queue."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from vinl.chain.navigators.base import Navigator
from vinl.policies.policy import Policy


@dataclass(frozen=True)
class Pause:
    """Stop time, or let it go on."""

    paused: bool


@dataclass(frozen=True)
class StepOnce:
    """One step of the source (20 ms when live), then pause."""


@dataclass(frozen=True)
class SetPace:
    """How fast time goes: 1 is real time, 0.1 a tenth of it."""

    pace: float


@dataclass(frozen=True)
class Reset:
    """Put the robot back to where it was last put down."""


@dataclass(frozen=True)
class SetGoal:
    """Walk to a point [m] with the navigator."""

    x: float
    y: float


@dataclass(frozen=True)
class Drive:
    """Walk with this command: forward [m/s], yaw rate [rad/s], left positive. Ends a walk to a goal."""

    forward: float
    turn: float


@dataclass(frozen=True)
class Push:
    """Change the trunk's velocity at once by so much [m/s], towards an angle from its heading [rad]."""

    speed: float
    angle: float


@dataclass(frozen=True)
class PlaceRobot:
    """Put the robot down at x, y [m], with its heading."""

    x: float
    y: float


@dataclass(frozen=True)
class ToggleBlock:
    """Take away the block at a point [m]; where there is none, put one down."""

    x: float
    y: float


@dataclass(frozen=True)
class ScatterClutter:
    """Draw the clutter anew from a preset; ``none`` clears the floor."""

    preset: str


@dataclass(frozen=True)
class ChangePolicies:
    """Other policies, or their names or folders; None keeps the one there is."""

    locomotion: str | Path | Policy | None = None
    navigation: str | Path | Navigator | None = None


@dataclass(frozen=True)
class OpenPlan:
    """Another floor plan, by name or file."""

    plan: str


@dataclass(frozen=True)
class Seek:
    """Go to a time of a recording [s]."""

    time: float


@dataclass(frozen=True)
class OpenEpisode:
    """Show another episode of the folder."""

    number: int


Request = (
    Pause
    | StepOnce
    | SetPace
    | Reset
    | SetGoal
    | Drive
    | Push
    | PlaceRobot
    | ToggleBlock
    | ScatterClutter
    | ChangePolicies
    | OpenPlan
    | Seek
    | OpenEpisode
)
"""Any of them."""
