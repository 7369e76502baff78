"""PPO for networks with memory and images, without waiting for the device inside roll-out or update.

rsl-rl's recurrent PPO pads trajectories and reads the learning rate and the losses from the device at every minibatch.
Here minibatches are whole robots with all their steps: the network gets the images of all steps at once, its memory
from the start of the roll-out, and flags where an episode begins. The interface is that of rsl-rl's ``PPO``.
"""

from __future__ import annotations

import copy
import math
import sys
from importlib.util import find_spec
from typing import Any

import torch
from tensordict import TensorDict
from torch import Tensor, nn

from vinl.config.errors import InputError
from vinl.nav.compiled_vision import CompiledVision
from vinl.nav.config import NavConfig
from vinl.nav.learning_config import NavPpoConfig
from vinl.nav.memory_graph import MemoryGraph
from vinl.nav.recurrent_model import Outlook, RecurrentActorCritic, RecurrentStorage, as_unit
from vinl.nav.rollout_planner import RolloutPlanner
from vinl.policies.depth_memory import DepthMemory
from vinl.policies.nav_actor import NavActor
from vinl.policies.vision import Vision
from vinl.rl.learning_rate import DeviceRate
from vinl.rl.parallel import Peers

_LOG_2PI = math.log(2.0 * math.pi)
_SUMS = ("surrogate", "value", "entropy", "kl", "clipped", "gradient_norm")
"""What is added up on the device over an update."""


class RecurrentPPO:
    """Learns from roll-outs of a ``RecurrentActorCritic``.

    Observations are a ``TensorDict`` with ``vector`` (n, k), and ``depth`` (n, H, W) in [0, 1] unless the actor is
    blind.

    Args:
        config: of the algorithm; the learning rate is ``rate``'s.
    """

    def __init__(
        self,
        model: RecurrentActorCritic,
        storage: RecurrentStorage,
        rate: DeviceRate,
        config: NavPpoConfig,
        peers: Peers | None = None,
    ) -> None:
        if storage.robots % config.minibatches:
            raise InputError(f"num_envs {storage.robots} must be a multiple of ppo.minibatches {config.minibatches}")
        self.model, self.storage, self.rate, self.config = model, storage, rate, config
        self.entropy = config.entropy
        self.peers = peers or Peers()
        self.peers.share(model)
        self.device = storage.vector.device
        on_gpu = self.device.type == "cuda"
        self._bf16 = config.bf16 and on_gpu
        # one kernel for all weights; the rate lies on the device, so that no step waits for it
        self.optimizer = torch.optim.Adam(
            model.parameters(),
            lr=rate.value,
            eps=1e-5,
            fused=True,
            capturable=on_gpu,  # type: ignore[arg-type]
        )
        rate.bind(self.optimizer)
        memory = getattr(model.actor, "memory", None)
        vision = getattr(memory, "vision", None)
        fast = config.compiled and on_gpu and _has_triton()
        self._compiled: CompiledVision | None = None
        if fast and isinstance(vision, Vision):
            self._compiled = CompiledVision(vision)  # fuses what lies between convolutions
        if fast and isinstance(memory, DepthMemory) and memory.remembers:
            memory.loop = MemoryGraph(memory)
        self._state = tuple(part.clone() for part in storage.state)
        self._planner: RolloutPlanner | None = None
        if isinstance(model.actor, NavActor) and model.actor.grid is not None:
            self._planner = RolloutPlanner(model.actor, storage.robots, self.device, fast)
        self._fresh = torch.ones(storage.robots, dtype=torch.bool, device=self.device)
        self._sums = torch.zeros(len(_SUMS), device=self.device)
        self._kl = torch.zeros((), device=self.device)
        self._actor_learns = True
        self._step = 0

    @property
    def learning_rate(self) -> float:
        """The present rate; waits for the device."""
        return self.rate.read()

    def let_actor_learn(self, learns: bool) -> None:
        """Whether the actor and its spread learn from the next minibatch on, or the critic's own weights alone."""
        self._actor_learns = learns

    def act(self, observation: TensorDict) -> Tensor:
        """Sampled actions (n, a); the observation is stored."""
        st, t = self.storage, self._step
        if t == 0:
            st.begin(self._state, self.model.log_std)
        depth = self._keep(observation, t)
        st.fresh[t] = self._fresh
        with torch.no_grad():
            seen = self._look(depth, st.vector[t][None], self._state, self._fresh[None])
        self._remember(seen.state)
        mean, noise = seen.mean[0], torch.randn_like(seen.mean[0])
        st.means[t], st.values[t] = mean, seen.value[0]
        torch.addcmul(mean, noise, st.log_std.exp(), out=st.actions[t])
        st.log_prob[t] = _log_prob(st.actions[t], mean, st.log_std)
        return st.actions[t]

    def process_env_step(
        self, observation: TensorDict, rewards: Tensor, dones: Tensor, extras: dict[str, Tensor]
    ) -> None:
        """What came of the actions: rewards (n,), dones (n,), ``time_outs`` (n,) in ``extras``."""
        st, t = self.storage, self._step
        st.rewards[t] = rewards
        if "time_outs" in extras:  # an episode cut off by the clock would have gone on
            st.rewards[t] += self.config.gamma * st.values[t] * extras["time_outs"].float()
        st.done[t] = dones.bool()
        self._fresh.copy_(dones)
        self._step += 1

    def compute_returns(self, observation: TensorDict) -> None:
        """Advantages of the roll-out, normalised; ``observation`` is the one after its last step."""
        st, s = self.storage, self.config
        depth = st.as_stored(observation["depth"])[None] if st.depth is not None else None
        vector = self._plan(depth, observation["vector"])
        with torch.no_grad():
            seen = self._look(depth, vector[None], self._state, self._fresh[None])
        st.estimate_advantages(seen.value[0], s.gamma, s.lam)
        mean = st.advantages.mean()
        self.peers.average(mean)
        square = (st.advantages - mean).square().mean()
        self.peers.average(square)
        st.advantages.sub_(mean).div_(square.sqrt() + 1e-8)

    def update(self) -> dict[str, float]:
        """Learn from the roll-out; the losses are read once, at the end.

        Raises:
            FloatingPointError: the loss is no longer finite.
        """
        s, n = self.config, self.storage.robots
        self._sums.zero_()
        for _ in range(s.epochs):
            self._kl.zero_()
            for robots in torch.randperm(n, device=self.device).chunk(s.minibatches):
                self._learn(robots)
        kl = self._kl / s.minibatches
        self.peers.average(kl)
        self.rate.steer(kl)
        self._step = 0
        means = (self._sums / (s.epochs * s.minibatches)).tolist()
        if not all(math.isfinite(x) for x in means):
            raise FloatingPointError(
                "the loss is not finite; go on from the last checkpoint with a lower learning rate"
            )
        return dict(zip(_SUMS, means, strict=True))

    def get_policy(self) -> RecurrentActorCritic:
        """The model."""
        return self.model

    def train_mode(self) -> None:
        """No layer of the model acts differently in training."""
        self.model.train()

    def save(self) -> dict[str, Any]:
        """Weights, optimiser, rate, and the memory of the robots."""
        return {
            "model": self.model.state_dict(),
            "optimizer": self.optimizer.state_dict(),
            "learning_rate": self.rate.read(),
            "memory": [part.clone() for part in self._state],
            "grid": [part.clone() for part in self._planner.grid] if self._planner else [],
            "fresh": self._fresh.clone(),
        }

    def load(self, saved: dict[str, Any], load_cfg: dict[str, bool] | None = None, strict: bool = True) -> bool:
        """Go on from what ``save`` returned; robots of another number begin new episodes of memory."""
        self.model.load_state_dict(saved["model"], strict=strict)
        self.optimizer.load_state_dict(copy.deepcopy(saved["optimizer"]))
        for weight, kept in self.optimizer.state.items():  # in the weight's layout, which may have been another
            for name in ("exp_avg", "exp_avg_sq"):
                kept[name] = torch.empty_like(weight).copy_(kept[name])
        self.rate.set(saved["learning_rate"])
        self.rate.bind(self.optimizer)
        if len(saved["fresh"]) == len(self._fresh):
            self._remember(tuple(saved["memory"]))
            if self._planner is not None:
                for part, now in zip(self._planner.grid, saved["grid"], strict=True):
                    part.copy_(now)
            self._fresh.copy_(saved["fresh"])
        return True

    def _keep(self, observation: TensorDict, t: int) -> Tensor | None:
        """Store the observation of step t; returns its images (1, n, height, width)."""
        st = self.storage
        depth: Tensor | None = None
        if st.depth is not None:
            st.depth[t] = st.as_stored(observation["depth"])
            depth = st.depth[t][None]
        st.vector[t] = self._plan(depth, observation["vector"])
        if self._planner is not None:
            self._planner.go_on()
        return depth

    def _plan(self, depth: Tensor | None, vector: Tensor) -> Tensor:
        """The vector, with what is planned on the robots' grids: once in a roll-out, for it has no weights to learn."""
        if self._planner is None or depth is None:
            return vector
        return self._planner.plan(as_unit(depth[0]), vector, self._fresh)

    def _remember(self, state: tuple[Tensor, ...]) -> None:
        for part, now in zip(self._state, state, strict=True):
            part.copy_(now)

    def _look(self, depth: Tensor | None, vector: Tensor, state: tuple[Tensor, ...], fresh: Tensor) -> Outlook:
        """What the model makes of t steps, in the precision of the training; see ``RecurrentActorCritic.forward``."""
        with torch.autocast(self.device.type, torch.bfloat16, enabled=self._bf16):
            if self._compiled is not None and depth is not None:
                self._compiled.check(depth)
            return self.model(depth, vector, state, fresh)

    def _learn(self, robots: Tensor) -> None:
        """One step of the optimiser on all steps of some robots."""
        s, st, model = self.config, self.storage, self.model
        batch = st.take(robots)
        mean, value, _ = self._look(batch.depth, batch.vector, batch.state, batch.fresh)
        log_std = model.log_std
        log_ratio = _log_prob(batch.actions, mean, log_std) - batch.log_prob
        ratio = log_ratio.exp()
        bounded = ratio.clamp(1.0 - s.clip, 1.0 + s.clip)
        surrogate = -torch.min(ratio * batch.advantages, bounded * batch.advantages).mean()
        near = batch.values + (value - batch.values).clamp(-s.clip, s.clip)
        value_loss = torch.max((value - batch.returns).square(), (near - batch.returns).square()).mean()
        entropy = (log_std + 0.5 * (1.0 + _LOG_2PI)).sum()
        loss = surrogate + s.value * value_loss - self.entropy * entropy
        self.optimizer.zero_grad(set_to_none=True)
        loss.backward()
        if not self._actor_learns:  # Adam leaves a weight alone whose gradient has always been zero
            for weight in model.actor_parameters():
                if weight.grad is not None:
                    weight.grad.zero_()
        self.peers.average_gradients(model.parameters())
        norm = nn.utils.clip_grad_norm_(model.parameters(), s.max_grad_norm)
        self.optimizer.step()
        model.hold_spread()
        with torch.no_grad():
            kl = _divergence(batch.means, st.log_std, mean, log_std).mean()
            clipped = (bounded != ratio).float().mean()
            self._kl += kl
            self._sums += torch.stack([surrogate, value_loss, entropy, kl, clipped, norm])


def build_storage(config: NavConfig, actor: NavActor, device: torch.device | str) -> RecurrentStorage:
    """The roll-out's buffers of a training."""
    return RecurrentStorage(
        config.ppo.steps,
        config.num_envs,
        actor.image,
        config.ppo.image_type,
        actor.input_size,
        actor.action_size,
        actor.memory.initial_state(config.num_envs, device),
        device,
    )


def _has_triton() -> bool:
    """Whether kernels can be compiled for the GPU; asked once, for all that is compiled."""
    if find_spec("triton") is not None:
        return True
    print("warning: no Triton; nothing is compiled, which is slower", file=sys.stderr)
    return False


def _log_prob(action: Tensor, mean: Tensor, log_std: Tensor) -> Tensor:
    """Logarithm of the density of a diagonal normal distribution, (..., a) to (...)."""
    return (-0.5 * ((action - mean) * (-log_std).exp()).square() - log_std - 0.5 * _LOG_2PI).sum(-1)


def _divergence(mean_a: Tensor, log_std_a: Tensor, mean_b: Tensor, log_std_b: Tensor) -> Tensor:
    """KL(a || b) of diagonal normal distributions, (..., a) to (...)."""
    variance = (2.0 * log_std_a).exp() + (mean_a - mean_b).square()
    return (log_std_b - log_std_a + 0.5 * variance * (-2.0 * log_std_b).exp() - 0.5).sum(-1)
