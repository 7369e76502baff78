"""What decides where the robot walks, twice a second."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float

from vinl.config.errors import InputError
from vinl.config.fields import closest
from vinl.evaluation.config import EvaluationConfig
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
        """Forward speed in [0, 1] m/s and yaw rate in [-pi/3, pi/3] rad/s of every robot.

        Args:
            observation: ``goal`` (n, 3): straight distance [m], cosine and sine of the bearing in the robot's heading
                frame, left positive; ``previous_action`` (n, 2): what this returned last, zero at first; ``pose``
                (n, 3): x, y [m] and yaw [rad], privileged, for oracles; ``depth`` (n, height, width) [m] if the
                navigator has a camera. Rows of episodes that are over stay, with their last values.
        """
        ...


NAVIGATORS = ("oracle",)
"""Navigators by name."""


def load_navigator(name: str, config: EvaluationConfig) -> Navigator:
    """A navigator by name.

    Raises:
        InputError: there is none of that name.
    """
    if name == "oracle":
        from vinl.evaluation.oracle import OracleNavigator

        return OracleNavigator(config.oracle)
    known = ", ".join(NAVIGATORS)
    raise InputError(f"unknown navigator {name!r}{closest(name, NAVIGATORS)}; known: {known}")
