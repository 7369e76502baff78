"""What decides where the robot walks, twice a second."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float
from torch import Tensor

from vinl.config.errors import InputError
from vinl.robot.cameras import Camera
from vinl.world.free_space import FreeSpace
from vinl.world.start_goal import StartGoal


@dataclass(frozen=True, eq=False)
class Task:
    """What a navigator may know about one episode before it starts. A learned navigator ignores it."""

    space: FreeSpace
    route: StartGoal


@runtime_checkable
class Navigator(Protocol):
    """Drives all robots of one unit of work in lockstep.

    Attributes:
        camera: the depth camera that it sees through, or None; ``act`` then finds ``depth`` in the observation.
    """

    camera: Camera | None

    def reset(self, episodes: Sequence[Task]) -> None:
        """Forget everything; so many episodes begin."""
        ...

    def act(self, observation: dict[str, Any]) -> Float[np.ndarray, "n 2"]:
        """Forward speed in [0, 1] m/s and yaw rate in [-pi/3, pi/3] rad/s of every robot. A negative speed walks back:
        to -0.3 m/s that was tried.

        Args:
            observation: ``goal`` (n, 3): straight distance [m], cosine and sine of the bearing in the robot's heading
                frame, left positive; ``previous_action`` (n, 2): what this returned last, zero at first; ``pose``
                (n, 3): x, y [m] and yaw [rad] where it believes to be, for odometry: how far it moved since the last
                decision; ``true_pose`` (n, 3) where it is, for oracles;
                ``depth`` (n, height, width) [m], if the navigator has a camera: a torch tensor that the next step
                overwrites. Rows of episodes that are over stay, with their last values.
        """
        ...


ORACLE = "oracle"
"""The name of the shortest-path follower."""


def goal_in_heading_frame(pose: Float[np.ndarray, "n 3"], goal: Float[np.ndarray, "n 2"]) -> Float[np.ndarray, "n 3"]:
    """Straight distance to the goal [m], cosine and sine of its bearing, left positive [ViNL code]."""
    to = goal - pose[:, :2]
    bearing = np.arctan2(to[:, 1], to[:, 0]) - pose[:, 2]
    return np.stack([np.linalg.norm(to, axis=1), np.cos(bearing), np.sin(bearing)], 1)


def decide(
    navigator: Navigator,
    goals: Float[np.ndarray, "n 2"],
    previous: Float[np.ndarray, "n 2"],
    pose: Float[np.ndarray, "n 3"],
    believed: Float[np.ndarray, "n 3"] | None = None,
    depth: Tensor | None = None,
) -> Float[np.ndarray, "n 2"]:
    """Ask a navigator: forward speeds [m/s] and yaw rates [rad/s].

    Args:
        navigator: see ``Navigator.act``, whose observation is made here and nowhere else.
        goals: x, y of each robot's goal [m].
        previous: what it answered last.
        pose: x, y [m] and yaw [rad] where the robots are.
        believed: where they believe to be; None: that is where they are.
        depth: (n, height, width) what its camera sees [m].

    Raises:
        InputError: what it answers has another shape than (n, 2), or numbers that are not finite.
    """
    believed = pose if believed is None else believed
    seen: dict[str, Any] = {
        "goal": goal_in_heading_frame(believed, goals),
        "previous_action": previous,
        "pose": believed,
        "true_pose": pose,
    }
    if depth is not None:
        seen["depth"] = depth
    choice = np.asarray(navigator.act(seen), dtype=np.float64)
    name = getattr(navigator, "name", type(navigator).__name__)
    if choice.shape != (n := len(pose), 2):
        raise InputError(f"navigator {name} must return speeds and yaw rates of shape ({n}, 2), got {choice.shape}")
    if not np.isfinite(choice).all():
        raise InputError(f"navigator {name} returned numbers that are not finite (NaN or infinite)")
    return choice
