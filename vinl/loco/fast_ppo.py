"""rsl-rl's PPO without waiting for the device: the same update, fewer and larger launches.

rsl-rl reads the divergence from the device at every minibatch to choose the learning rate, and three losses after it;
its optimiser launches a kernel for each weight. Here the rate lies on the device, losses are added up there and read
once, the optimiser is one kernel, and on request whole minibatches are one CUDA graph. To use it, name
``vinl.loco.fast_ppo:FastPPO`` as ``class_name`` of rsl-rl's ``algorithm``.
"""

from __future__ import annotations

from typing import Any

import torch
from rsl_rl.algorithms import PPO
from tensordict import TensorDict
from torch import Tensor, nn

from vinl.rl.learning_rate import DeviceRate
from vinl.rl.parallel import Peers
from vinl.rl.step_graph import StepGraph

_LOWEST, _HIGHEST = 1e-5, 1e-2
"""Limits of rsl-rl's adaptive learning rate."""

_LOSSES = ("value", "surrogate", "entropy")


class FastPPO(PPO):
    """For feed-forward actors and critics. The numbers are rsl-rl's up to rounding.

    Args:
        arguments, rest: as for rsl-rl's ``PPO``.
        graphs: minibatches as a CUDA graph, where there is one process.
        peers: processes that learn one policy, each from as many robots of its own; their numbers are those of one
            process that has all robots. None: this is the only one.

    Raises:
        ValueError: a setting that only rsl-rl's own update knows.
    """

    def __init__(self, *arguments: Any, graphs: bool = False, peers: Peers | None = None, **rest: Any) -> None:
        super().__init__(*arguments, **rest)
        self.peers = peers or Peers()
        for model in (self.actor, self.critic):
            self.peers.share(model)
        other = {"rnd": self.rnd, "symmetry": self.symmetry, "mixed precision": self.use_mixed_precision}
        other["several GPUs"] = self.is_multi_gpu
        unknown = [name for name, setting in other.items() if setting]
        if self.actor.is_recurrent or self.critic.is_recurrent:
            unknown.append("recurrent networks")
        if unknown:
            raise ValueError(f"FastPPO does not know {', '.join(unknown)}; use rsl-rl's PPO")
        self._on_gpu = torch.device(self.device).type == "cuda"
        self.rate = DeviceRate(self._first_rate, _LOWEST, _HIGHEST, self.desired_kl, 1.5, 1.5, self.device)
        self.optimizer = torch.optim.Adam(
            [*self.actor.parameters(), *self.critic.parameters()],
            lr=self.rate.value,
            fused=True,
            capturable=self._on_gpu,
        )
        self.rate.bind(self.optimizer)
        # whether messages between GPUs can be recorded is not tried: several processes learn without graphs
        self._graph = StepGraph(self._learn) if graphs and self._on_gpu and self.peers.count == 1 else None
        self._sums = torch.zeros(len(_LOSSES), device=self.device)
        self._entropy_weight = torch.zeros((), device=self.device)
        self._advantages = torch.zeros_like(self.storage.advantages)

    @property
    def learning_rate(self) -> float:
        """The present rate; waits for the device."""
        return self.rate.read()

    @learning_rate.setter
    def learning_rate(self, rate: float) -> None:
        if "rate" in self.__dict__:
            self.rate.set(float(rate))
        else:  # rsl-rl's own initialisation
            self._first_rate = float(rate)

    def limit_rate(self, highest: float) -> None:
        """Hold the learning rate, which follows the divergence, to a limit."""
        self.rate.limit(min(_LOWEST, highest), highest)

    def compute_returns(self, obs: TensorDict) -> None:
        """See rsl-rl; the advantages are kept in a place of their own."""
        super().compute_returns(obs)
        st = self.storage
        if self.peers.count > 1 and not self.normalize_advantage_per_mini_batch:  # rsl-rl knows its own robots alone
            st.advantages = self._standardise(st.returns - st.values)
        self._advantages.copy_(st.advantages)

    def update(self) -> dict[str, float]:
        """See rsl-rl; the device is waited for once, at the end."""
        st = self.storage
        self._take_over_settings()
        self._sums.zero_()
        size = st.num_envs * st.num_transitions_per_env // self.num_mini_batches
        order = torch.randperm(self.num_mini_batches * size, device=self.device)
        # what the step branches on
        variant = (
            self.rate.desired_kl is None,
            *(next(m.parameters()).requires_grad for m in (self.actor, self.critic)),
        )
        for _ in range(self.num_learning_epochs):
            for index in order.split(size):
                if self._graph is None:
                    self._learn(index)
                else:
                    self._graph.run(index, variant)
        observations = st.observations.flatten(0, 1)
        self.actor.update_normalization(observations)  # type: ignore[arg-type]
        self.critic.update_normalization(observations)  # type: ignore[arg-type]
        self.peers.average(self._sums)
        means = (self._sums / (self.num_learning_epochs * self.num_mini_batches)).tolist()
        st.clear()
        return dict(zip(_LOSSES, means, strict=True))

    def save(self) -> dict[str, Any]:
        """As rsl-rl's: its ``PPO`` can load it."""
        saved = super().save()
        optimizer = saved["optimizer_state_dict"]
        groups = [{**group, "lr": self.rate.read()} for group in optimizer["param_groups"]]
        return {**saved, "optimizer_state_dict": {**optimizer, "param_groups": groups}}

    def load(self, loaded_dict: dict[str, Any], load_cfg: dict[str, Any] | None, strict: bool) -> bool:
        """As rsl-rl's: what its ``PPO`` saved can be loaded."""
        result = super().load(loaded_dict, load_cfg, strict)
        for group in self.optimizer.param_groups:
            group.update(fused=True, capturable=self._on_gpu, foreach=None)
        for state in self.optimizer.state.values():
            state["step"] = torch.as_tensor(state["step"], dtype=torch.float32).to(self.device)
        self.rate.bind(self.optimizer)
        return result

    def _take_over_settings(self) -> None:
        """What a schedule may have changed: the rate by a number in the optimiser, the divergence, the entropy."""
        given = self.optimizer.param_groups[0]["lr"]
        if given is not self.rate.value:
            self.rate.set(float(given))
        self.rate.bind(self.optimizer)
        self.rate.desired_kl = self.desired_kl if self.schedule == "adaptive" else None
        self._entropy_weight.fill_(self.entropy_coef)

    def _standardise(self, values: Tensor) -> Tensor:
        """Values of any shape, less their mean over all processes, by their standard deviation."""
        mean = values.mean()
        self.peers.average(mean)
        variance = (values - mean).square().mean()
        self.peers.average(variance)
        count = values.numel() * self.peers.count
        return (values - mean) / ((variance * (count / (count - 1))).sqrt() + 1e-8)

    def _learn(self, index: Tensor) -> None:
        """One step of the optimiser on the steps of an index into the flattened roll-out."""
        st = self.storage
        assert st.distribution_params is not None

        def pick(buffer: Tensor) -> Tensor:
            return buffer.flatten(0, 1)[index]

        observations = st.observations.flatten(0, 1)[index]
        old_values, returns = pick(st.values), pick(st.returns)
        advantages = pick(self._advantages).squeeze(-1)
        if self.normalize_advantage_per_mini_batch:
            advantages = self._standardise(advantages)
        self.actor(observations, stochastic_output=True)
        log_prob = self.actor.get_output_log_prob(pick(st.actions))
        values = self.critic(observations)
        entropy = self.actor.output_entropy.mean()
        if self.rate.desired_kl is not None:
            with torch.no_grad():
                old = tuple(pick(p) for p in st.distribution_params)
                kl = self.actor.get_kl_divergence(old, self.actor.output_distribution_params).mean()
                self.peers.average(kl)
                self.rate.steer(kl)
        ratio = torch.exp(log_prob - pick(st.actions_log_prob).squeeze(-1))
        bounded = ratio.clamp(1.0 - self.clip_param, 1.0 + self.clip_param)
        surrogate = torch.max(-advantages * ratio, -advantages * bounded).mean()
        value_loss = (values - returns).square()
        if self.use_clipped_value_loss:
            near = old_values + (values - old_values).clamp(-self.clip_param, self.clip_param)
            value_loss = torch.max(value_loss, (near - returns).square())
        value_loss = value_loss.mean()
        loss = surrogate + self.value_loss_coef * value_loss - self._entropy_weight * entropy
        self.optimizer.zero_grad(set_to_none=True)
        loss.backward()
        self.peers.average_gradients([*self.actor.parameters(), *self.critic.parameters()])
        nn.utils.clip_grad_norm_(self.actor.parameters(), self.max_grad_norm)
        nn.utils.clip_grad_norm_(self.critic.parameters(), self.max_grad_norm)
        self.optimizer.step()
        self._sums += torch.stack([value_loss.detach(), surrogate.detach(), entropy.detach()])
