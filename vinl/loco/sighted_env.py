"""The locomotion environment with depth images."""

from __future__ import annotations

from typing import Any

import torch
from tensordict import TensorDict

from vinl.loco.environment import LocoEnvironment, StepResult
from vinl.loco.sight import Sight
from vinl.loco.vec_env import LocoVecEnv
from vinl.rl.stopwatch import Stopwatch


class SightedVecEnv(LocoVecEnv):
    """More observation groups: ``depth`` (n, H, W) float16 in [0, 1], and what a student learns to predict, ``plan``,
    ``heights`` and ``velocity``, see ``environment.Observations``.

    Args:
        environment: the robots.
        sight: their cameras.
        device: torch device; JAX must run on the same kind.
        stopwatch: times ``simulate`` and ``render``.
    """

    def __init__(self, environment: LocoEnvironment, sight: Sight, device: str, stopwatch: Stopwatch) -> None:
        super().__init__(environment, device)
        self.sight, self._stopwatch = sight, stopwatch

    def save_state(self) -> dict[str, Any]:
        """The whole state of all robots and cameras."""
        return {**super().save_state(), "sight": self.sight.save_state()}

    def load_state(self, state: dict[str, Any]) -> None:
        """Go on from a saved state.

        Raises:
            ValueError: the state is of another number of robots.
        """
        super().load_state(state)
        self.sight.load_state(state["sight"])

    def _simulate(self, actions: torch.Tensor) -> StepResult:
        with self._stopwatch.part("simulate"):
            return super()._simulate(actions)

    def _pack(self, seen: dict[str, torch.Tensor], done: torch.Tensor | None) -> TensorDict:
        observation = super()._pack(seen, done)
        for name in ("plan", "heights", "velocity"):
            observation[name] = seen[name]
        with self._stopwatch.part("render"):
            observation["depth"] = self.sight.look(seen["pose"], done)
        return observation
