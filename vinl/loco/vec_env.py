"""The locomotion environment as an rsl-rl environment: JAX on one side, torch on the other, no copies on a GPU."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import jax
import numpy as np
import torch
from rsl_rl.env import VecEnv
from tensordict import TensorDict

from vinl.gait.state import GaitState
from vinl.loco.environment import LocoEnvironment, Observations, StepResult
from vinl.loco.state import EnvState
from vinl.rl.stopwatch import Stopwatch

if TYPE_CHECKING:
    from vinl.loco.terrain_cameras import TerrainCameras  # Warp is started for stage 3 alone

_LENT = 8
"""How many steps lent arrays are kept alive: the two libraries run on streams of their own, and neither may reuse
memory that the other still reads."""


class LocoVecEnv(VecEnv):
    """Observation groups: ``policy`` (with noise, in the order of ``gait.observation.STEPPING_MAP_TABLE``), ``critic``
    (the same exactly, then what only the critic knows).

    Args:
        device: torch device; JAX must run on the same kind.

    Attributes:
        followed: gives the gaits that robots follow, in torch, in place of the environment's own.
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
        self._lent: deque[torch.Tensor] = deque(maxlen=_LENT * len(GaitState._fields))
        self._count = 0
        self.followed: Callable[[], GaitState] | None = None
        self._seen: dict[str, torch.Tensor] | None = None
        self._resumed: dict[str, torch.Tensor] | None = None

    def get_observations(self) -> TensorDict:
        """Of the present state."""
        seen, self._resumed = self._resumed or self._in_torch(self.environment.observe()), None
        return self._pack({name: x.clone() for name, x in seen.items()}, None)

    def step(self, actions: torch.Tensor) -> tuple[TensorDict, torch.Tensor, torch.Tensor, dict[str, Any]]:
        """Actions (n, 12) to observations, rewards (n,), dones (n,) and ``time_outs`` (n,)."""
        seen, *ends = self._simulate(actions)
        reward, done, timeout = (self._to_torch(x) for x in ends)
        self._seen = self._in_torch(seen)
        return self._pack(self._seen, done), reward, done, {"time_outs": timeout.float()}

    def _simulate(self, actions: torch.Tensor) -> StepResult:
        gait = None if self.followed is None else GaitState(*(self._to_jax(x) for x in self.followed()))
        if not self._on_gpu:
            return self.environment.step(self._to_jax(actions), gait)
        lent = self._actions[self._count % _LENT]
        self._count += 1
        lent.copy_(actions)
        result = self.environment.step(jax.dlpack.from_dlpack(lent), gait)
        self._results.append(result)
        return result

    def read_measures(self) -> dict[str, float]:
        """Means since the last call."""
        return self.environment.read_measures()

    def take_lost(self) -> list[dict[str, Any]]:
        """States before the steps that went wrong, see ``LocoEnvironment.take_lost``."""
        return self.environment.take_lost()

    def save_state(self) -> dict[str, Any]:
        """The whole state of all robots, levels and random numbers included: arrays by the names of their fields. And
        what was seen of it: looked at anew, outside the compiled step, it may differ in the last bits."""
        state = {name: _saved(np.asarray(x)) for name, x in _by_name(self.environment.state).items()}
        seen = {} if self._seen is None else {"seen": {name: x.cpu().clone() for name, x in self._seen.items()}}
        return {**state, "noise": torch.tensor(float(self.environment.noise)), **seen}

    def load_state(self, state: dict[str, Any]) -> None:
        """Go on from a saved state.

        Raises:
            ValueError: the state is of another number of robots, or of another version.
        """
        present = _by_name(self.environment.state)
        lacking = sorted(present.keys() - state.keys())
        if lacking:
            raise ValueError(f"it holds no {', '.join(lacking)}: another version wrote it")
        saved = {name: state[name].numpy().astype(x.dtype) for name, x in present.items()}
        if saved["sums"].shape != present["sums"].shape:  # since they were last read, of other measures
            saved["sums"] = np.zeros(present["sums"].shape, np.float32)
        if any(saved[name].shape != x.shape for name, x in present.items()):
            raise ValueError(f"it holds {len(saved['step'])} robots, this run has {self.num_envs}")
        if "noise" in state:
            self.environment.set_noise(float(state["noise"]))
        seen = state.get("seen")  # None: an older version wrote it
        self._seen = self._resumed = None if seen is None else {name: x.to(self.device) for name, x in seen.items()}
        leaves = [saved[name] for name in present]
        shape = jax.tree.structure(self.environment.state)
        self.environment.state = jax.device_put(jax.tree.unflatten(shape, leaves), jax.devices()[0])

    def _pack(self, seen: dict[str, torch.Tensor], done: torch.Tensor | None) -> TensorDict:
        """``seen``: the fields of ``Observations``; ``done`` (n,) where an episode has just begun, None: no step was
        made."""
        groups = {"policy": seen["noisy"], "critic": torch.cat([seen["exact"], seen["privileged"]], 1)}
        return TensorDict(groups, batch_size=[self.num_envs])  # type: ignore[arg-type]

    def _in_torch(self, seen: Observations) -> dict[str, torch.Tensor]:
        return {name: self._to_torch(x) for name, x in seen._asdict().items()}

    def _to_jax(self, x: torch.Tensor) -> jax.Array:
        if not self._on_gpu:
            return jax.numpy.asarray(x.numpy())
        self._lent.append(x.contiguous().clone())
        return jax.dlpack.from_dlpack(self._lent[-1])

    def _to_torch(self, x: jax.Array) -> torch.Tensor:
        return torch.from_dlpack(x) if self._on_gpu else torch.from_numpy(np.array(x))


def _by_name(state: EnvState) -> dict[str, jax.Array]:
    """The arrays of a state, in their order, by the names of its fields joined by dots."""
    paths = jax.tree_util.tree_flatten_with_path(state)[0]
    return {".".join(part.name for part in path): leaf for path, leaf in paths}  # type: ignore[attr-defined]


def _saved(x: np.ndarray) -> torch.Tensor:
    # torch lacks most operations on unsigned 32-bit numbers
    return torch.from_numpy(x.astype(np.int64) if x.dtype == np.uint32 else x.copy())


class CameraVecEnv(LocoVecEnv):
    """More observation groups: ``depth`` (n, H, W) float16 in [0, 1] and its ``age`` (n,) [s], and what is true of what
    a student believes, ``heights`` and ``velocity``, see ``environment.Observations``.

    Args:
        device: torch device; JAX must run on the same kind.
        stopwatch: times ``simulate`` and ``render``.
    """

    def __init__(
        self, environment: LocoEnvironment, cameras: TerrainCameras, device: str, stopwatch: Stopwatch
    ) -> None:
        super().__init__(environment, device)
        self.cameras, self._stopwatch = cameras, stopwatch

    def save_state(self) -> dict[str, Any]:
        """The whole state of all robots and cameras."""
        return {**super().save_state(), "cameras": self.cameras.save_state()}

    def load_state(self, state: dict[str, Any]) -> None:
        """Go on from a saved state.

        Raises:
            ValueError: the state is of another number of robots or of other cameras.
        """
        if "cameras" not in state:
            raise ValueError("it holds no cameras: another version wrote it")
        super().load_state(state)
        self.cameras.load_state(state["cameras"])

    def _simulate(self, actions: torch.Tensor) -> StepResult:
        with self._stopwatch.part("simulate"):
            return super()._simulate(actions)

    def _pack(self, seen: dict[str, torch.Tensor], done: torch.Tensor | None) -> TensorDict:
        observation = super()._pack(seen, done)
        for name in ("heights", "velocity", "latency"):
            observation[name] = seen[name]
        with self._stopwatch.part("render"):
            observation["depth"], observation["age"] = self.cameras.look(seen["pose"], done), self.cameras.age
        return observation
