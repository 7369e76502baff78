"""A roll-out of robots with memory: whole sequences of steps, images in two bytes or one."""

from __future__ import annotations

from typing import NamedTuple

import torch
from jaxtyping import Bool, Float
from torch import Tensor

from vinl.policies.depth_memory import State


class Minibatch(NamedTuple):
    """All steps of some of the robots; arguments of the model first. Shapes (t, n, ...), the state (layers, n, ...)."""

    depth: Tensor | None
    vector: Tensor
    state: State
    fresh: Tensor
    actions: Tensor
    log_prob: Tensor
    means: Tensor
    values: Tensor
    advantages: Tensor
    returns: Tensor
    hidden: Tensor | None


class RecurrentStorage:
    """Buffers that are written during the roll-out and never reallocated.

    Args:
        steps, robots: t and n.
        image: (height, width) of the images, or None.
        image_type: one of ``ppo_config.IMAGE_TYPES``.
        vector, actions, hidden: sizes; ``hidden`` 0: there is none.
        state: of the robots at the start; its shapes are taken.
        device: where the buffers lie.
    """

    def __init__(
        self,
        steps: int,
        robots: int,
        image: tuple[int, int] | None,
        image_type: str,
        vector: int,
        actions: int,
        state: State,
        device: torch.device | str,
        hidden: int = 0,
    ) -> None:
        def room(*size: int, dtype: torch.dtype = torch.float32) -> Tensor:
            return torch.zeros(steps, robots, *size, dtype=dtype, device=device)

        self.steps, self.robots = steps, robots
        self.depth = room(*image, dtype=getattr(torch, image_type)) if image else None
        self.vector, self.actions, self.means = room(vector), room(actions), room(actions)
        self.hidden = room(hidden) if hidden else None
        self.fresh, self.done = room(dtype=torch.bool), room(dtype=torch.bool)
        self.log_prob, self.values, self.rewards = room(), room(), room()
        self.advantages, self.returns = room(), room()
        self.state = tuple(torch.zeros_like(part) for part in state)
        self.log_std = torch.zeros(actions, device=device)

    def as_stored(self, depth: Tensor) -> Tensor:
        """Images in [0, 1] as they are kept; the policy acts on these, so that it learns from what it saw."""
        assert self.depth is not None
        if self.depth.dtype == torch.uint8:
            return (depth * 255.0 + 0.5).to(torch.uint8)
        return depth.to(self.depth.dtype)

    def begin(self, state: State, log_std: Float[Tensor, " a"]) -> None:
        """A roll-out begins with this memory and this spread of the actions."""
        for part, now in zip(self.state, state, strict=True):
            part.copy_(now)
        self.log_std.copy_(log_std)

    def estimate_advantages(self, last_values: Float[Tensor, " n"], gamma: float, lam: float) -> None:
        """Generalised advantages and returns of the whole roll-out, not yet normalised."""
        going_on = (~self.done).float()
        advantage = torch.zeros_like(last_values)
        following = last_values
        for t in reversed(range(self.steps)):
            error = self.rewards[t] + gamma * going_on[t] * following - self.values[t]
            advantage = error + gamma * lam * going_on[t] * advantage
            self.advantages[t] = advantage
            following = self.values[t]
        torch.add(self.advantages, self.values, out=self.returns)

    def take(self, robots: Bool[Tensor, "..."] | Tensor) -> Minibatch:
        """All steps of the robots of an index (n,)."""

        def pick(buffer: Tensor) -> Tensor:
            return buffer.index_select(1, robots)

        return Minibatch(
            depth=None if self.depth is None else pick(self.depth),
            vector=pick(self.vector),
            state=tuple(pick(part) for part in self.state),
            fresh=pick(self.fresh),
            actions=pick(self.actions),
            log_prob=pick(self.log_prob),
            means=pick(self.means),
            values=pick(self.values),
            advantages=pick(self.advantages),
            returns=pick(self.returns),
            hidden=None if self.hidden is None else pick(self.hidden),
        )
