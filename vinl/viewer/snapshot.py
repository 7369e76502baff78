"""What a session shows of one moment: all that a view needs, and nothing that changes afterwards."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float

from vinl.robot.cameras import Camera
from vinl.viewer.world import World

STATES = ("standing", "walking", "driven", "reached", "fallen", "recorded")
"""What the robot is about."""


@dataclass(frozen=True, eq=False)
class DepthImage:
    """What a depth camera sees: (height, width) [m], and the camera."""

    camera: Camera
    depth: Float[np.ndarray, "height width"]


@dataclass(frozen=True, eq=False)
class Footholds:
    """Where the feet are to come down, in the world frame; legs in the order of ``LEGS``.

    Attributes:
        planned: (4, 3) chosen on the map of the ground [m]; None: the controller plans none.
        predicted: (4, 3) read from depth images by the policy [m]; None: it predicts none.
    """

    planned: Float[np.ndarray, "4 3"] | None = None
    predicted: Float[np.ndarray, "4 3"] | None = None


@dataclass(frozen=True, eq=False)
class Snapshot:
    """One moment of a session.

    Attributes:
        world: plan and clutter; another object when one of them changed.
        time_s: since the robot was last put down, or of a recording [s].
        state: one of ``STATES``.
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
    duration_s: float | None = None
    paused: bool = False
    pace: float = 1.0
    real_time: float = 0.0
    step_ms: float = 0.0
    notice: tuple[int, str] = (0, "")
