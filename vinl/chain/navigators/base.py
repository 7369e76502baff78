"""What decides where the robot walks, twice a second."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float

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


def check_choice(choice: Any, n: int, navigator: Navigator) -> Float[np.ndarray, "n 2"]:
    """What a navigator answered, if it makes sense.

    Raises:
        InputError: another shape than (n, 2), or numbers that are not finite.
    """
    found = np.asarray(choice, dtype=np.float64)
    name = getattr(navigator, "name", type(navigator).__name__)
    if found.shape != (n, 2):
        raise InputError(f"navigator {name} must return speeds and yaw rates of shape ({n}, 2), got {found.shape}")
    if not np.isfinite(found).all():
        raise InputError(f"navigator {name} returned numbers that are not finite (NaN or infinite)")
    return found
