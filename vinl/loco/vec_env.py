"""The locomotion environment as an rsl-rl environment: JAX on one side, torch on the other, no copies on a GPU."""

from __future__ import annotations

from collections import deque
from typing import Any

import jax
import numpy as np
import torch
from rsl_rl.env import VecEnv
from tensordict import TensorDict

from vinl.loco.environment import LocoEnvironment, StepResult

_LENT = 8
"""How many steps lent arrays are kept alive: the two libraries run on streams of their own, and neither may reuse
memory that the other still reads."""


class LocoVecEnv(VecEnv):
    """Observation groups: ``policy`` (with noise) and ``critic`` (exact), both (n, 235).

    Args:
        environment: the robots.
        device: torch device; JAX must run on the same kind.
    """

    def __init__(self, environment: LocoEnvironment, device: str) -> None:
        self.environment = environment
        self.num_envs, self.num_actions = environment.num_envs, 12
        self.max_episode_length = environment.episode_steps
        self.episode_length_buf = torch.zeros(self.num_envs, dtype=torch.long)
        self.device, self.cfg = device, {}
        self._on_gpu = device.startswith("cuda")
        self._actions = [torch.zeros(self.num_envs, 12, device=device) for _ in range(_LENT)]
        self._results: deque[StepResult] = deque(maxlen=_LENT)
        self._count = 0

    def get_observations(self) -> TensorDict:
        """Of the present state."""
        noisy, exact = (self._to_torch(x).clone() for x in self.environment.observe())
        return self._pack(noisy, exact, self._to_torch(self.environment.trunk_pose()).clone(), None)

    def step(self, actions: torch.Tensor) -> tuple[TensorDict, torch.Tensor, torch.Tensor, dict[str, Any]]:
        """Actions (n, 12) to observations, rewards (n,), dones (n,) and ``time_outs`` (n,)."""
        noisy, exact, reward, done, timeout, pose = (self._to_torch(x) for x in self._simulate(actions))
        return self._pack(noisy, exact, pose, done), reward, done, {"time_outs": timeout.float()}

    def _simulate(self, actions: torch.Tensor) -> StepResult:
        if not self._on_gpu:
            return self.environment.step(jax.numpy.asarray(actions.numpy()))
        lent = self._actions[self._count % _LENT]
        self._count += 1
        lent.copy_(actions)
        result = self.environment.step(jax.dlpack.from_dlpack(lent))
        self._results.append(result)
        return result

    def read_measures(self) -> dict[str, float]:
        """Means since the last call."""
        return self.environment.read_measures()

    def take_lost(self) -> list[dict[str, Any]]:
        """States before the steps that went wrong, see ``LocoEnvironment.take_lost``."""
        return self.environment.take_lost()

    def save_state(self) -> dict[str, Any]:
        """The whole state of all robots, levels and random numbers included."""
        leaves = [np.asarray(x) for x in jax.tree.leaves(self.environment.state)]
        # torch lacks most operations on unsigned 32-bit numbers
        return {"leaves": [torch.from_numpy(x.astype(np.int64) if x.dtype == np.uint32 else x.copy()) for x in leaves]}

    def load_state(self, state: dict[str, Any]) -> None:
        """Go on from a saved state.

        Raises:
            ValueError: the state is of another number of robots.
        """
        leaves, shape = jax.tree.flatten(self.environment.state)
        saved = [x.numpy().astype(leaf.dtype) for x, leaf in zip(state["leaves"], leaves, strict=True)]
        if (
            saved[-1].shape != leaves[-1].shape
        ):  # sums since they were last read: a version with other measures wrote it
            saved[-1] = np.zeros(leaves[-1].shape, leaves[-1].dtype)
        if [x.shape for x in saved] != [leaf.shape for leaf in leaves]:
            raise ValueError(f"it holds {len(saved[1])} robots, this run has {self.num_envs}")
        self.environment.state = jax.device_put(jax.tree.unflatten(shape, saved), jax.devices()[0])

    def _pack(
        self, noisy: torch.Tensor, exact: torch.Tensor, pose: torch.Tensor, done: torch.Tensor | None
    ) -> TensorDict:
        """``pose`` (n, 7) of the trunks; ``done`` (n,) where an episode has just begun, None: no step was made."""
        return TensorDict({"policy": noisy, "critic": exact}, batch_size=[self.num_envs])

    def _to_torch(self, x: jax.Array) -> torch.Tensor:
        return torch.from_dlpack(x) if self._on_gpu else torch.from_numpy(np.array(x))
