"""Functions of one's own as navigators and locomotors of the chain."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import torch
from jaxtyping import Float

from vinl.chain.navigators.base import Task
from vinl.config.errors import InputError
from vinl.policies.card import PolicyCard, locomotion_card
from vinl.robot.aliengo import ACTION_SCALE, DEFAULT_POSE, KD, KP
from vinl.robot.cameras import Camera
from vinl.robot.observation import PROPRIOCEPTION_SIZE


class OwnNavigator:
    """A function that decides where to walk, see ``as_navigator``."""

    def __init__(self, decide: Callable[[dict[str, Any]], Any], camera: Camera | None, name: str) -> None:
        self._decide, self.camera, self.name = decide, camera, name

    def reset(self, episodes: Sequence[Task]) -> None:
        """Tells the function that so many episodes begin, if it has a ``reset`` of its own."""
        if hasattr(self._decide, "reset"):
            self._decide.reset(len(episodes))  # type: ignore[attr-defined]

    def act(self, observation: dict[str, Any]) -> Any:
        """See ``Navigator.act``."""
        return self._decide(observation)


class OwnLocomotor:
    """A function that moves the joints, see ``as_locomotor``."""

    def __init__(self, act: Callable[..., Any], camera: Camera | None, card: PolicyCard) -> None:
        self._act, self.camera, self.card = act, camera, card

    def reset(self, which: Any) -> None:
        """Tells the function that these robots start anew, if it has a ``reset`` of its own."""
        if hasattr(self._act, "reset"):
            self._act.reset(which)  # type: ignore[attr-defined]

    def act(self, observation: Float[np.ndarray, "n k"], depth: Any = None) -> Float[np.ndarray, "n 12"]:
        """Actions of all robots. Raises ``InputError`` if the function answered another shape, or numbers that are not
        finite."""
        seen = observation.astype(np.float32)
        answer = self._act(seen) if self.camera is None else self._act(seen, depth)
        found = np.asarray(answer.detach().cpu() if isinstance(answer, torch.Tensor) else answer, dtype=np.float32)
        n = len(observation)
        if found.shape != (n, 12):
            raise InputError(f"locomotor {self.card.name} must return actions of shape ({n}, 12), got {found.shape}")
        if not np.isfinite(found).all():
            raise InputError(f"locomotor {self.card.name} returned numbers that are not finite (NaN or infinite)")
        return found


def as_navigator(
    decide: Callable[[dict[str, Any]], Any], camera: Camera | None = None, name: str | None = None
) -> OwnNavigator:
    """A navigator from a function; an object with ``__call__`` and ``reset(n)`` may remember.

    Args:
        decide: is given what ``Navigator.act`` documents, for n robots at once: ``goal`` (n, 3), ``previous_action``
            (n, 2), ``pose`` (n, 3) and, with a camera, ``depth`` (n, height, width) [m]. Returns forward speeds
            [m/s] and yaw rates [rad/s], (n, 2), for the next half second.
        camera: that it sees through; none by default.
        name: in results; the function's own by default.
    """
    return OwnNavigator(decide, camera, name or getattr(decide, "__name__", type(decide).__name__))


def as_locomotor(
    act: Callable[..., Any],
    camera: Camera | None = None,
    name: str | None = None,
    scale: float = ACTION_SCALE,
    default_pose: Sequence[float] = tuple(DEFAULT_POSE),
    kp: float = KP,
    kd: float = KD,
) -> OwnLocomotor:
    """A locomotor from a function; an object with ``__call__`` and ``reset(n or mask)`` may remember.

    Args:
        act: is given the observations of n robots 50 times a second: (n, 48) float32, ``PROPRIOCEPTION`` in
            docs/robot.md; and with a camera depth (n, height, width) [m] as a torch tensor. Returns actions (n, 12):
            joint targets are ``default_pose + scale * action``.
        camera: that it sees through; none by default.
        name: in results; the function's own by default.
        scale: [rad].
        default_pose: joint angles [rad].
        kp: position gain of the joints [N m / rad].
        kd: velocity gain of the joints [N m s / rad].
    """
    called = name or getattr(act, "__name__", type(act).__name__)
    network = {"class": "function", "observation_size": PROPRIOCEPTION_SIZE}
    action = {"scale": scale, "default_pose": [float(q) for q in default_pose], "kp": kp, "kd": kd}
    seen = None if camera is None else camera.describe()
    return OwnLocomotor(act, camera, locomotion_card(called, network, action, camera=seen))
