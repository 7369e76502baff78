"""The navigation environment as the training loop wants it."""

from __future__ import annotations

from typing import Any

import torch
from tensordict import TensorDict

from vinl.nav.environment import NavEnvironment
from vinl.rl.parallel import Peers


class NavTrainingEnv:
    """Actions go in held to their range, observations come out as rsl-rl has them.

    Args:
        environment: the robots of this process.
        places: whether observations hold where the robot has been lately, for the network to guess.
        peers: the processes of the training.
    """

    def __init__(
        self,
        environment: NavEnvironment,
        places: bool = False,
        peers: Peers | None = None,
    ) -> None:
        self.environment, self._places = environment, places
        self.num_envs = environment.num_envs * (peers.count if peers else 1)

    def get_observations(self) -> TensorDict:
        """Of the present state."""
        depth, vector = self.environment.observe()
        return self._pack(depth, vector)

    def step(self, actions: torch.Tensor) -> tuple[TensorDict, torch.Tensor, torch.Tensor, dict[str, Any]]:
        """Actions (n, 2), held to [-1, 1], to observations, rewards (n,), dones (n,) and ``time_outs`` (n,)."""
        result = self.environment.step(actions.clamp(-1.0, 1.0))
        return self._pack(result.depth, result.vector), result.reward, result.done, {"time_outs": result.timeout}

    def read_measures(self) -> dict[str, float]:
        """Figures of the episodes that ended since the last call."""
        return self.environment.read_measures()

    def save_state(self) -> dict[str, Any]:
        """Of all robots."""
        return self.environment.save_state()

    def load_state(self, state: dict[str, Any] | None) -> None:
        """Go on from a saved state; None: the robots begin anew."""
        if state is not None:
            self.environment.load_state(state)

    def _pack(self, depth: torch.Tensor, vector: torch.Tensor) -> TensorDict:
        seen = {"vector": vector}
        if self.environment.camera is not None:
            seen["depth"] = depth
        if self._places:
            seen["hidden"] = self.environment.find_places()
        return TensorDict(seen, batch_size=[len(vector)])
