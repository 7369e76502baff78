"""Tiny networks that see, under the signature of the shipped ones, for all tests of the chain.

A module of its own: worker processes import it by its name.
"""

import torch
from torch import Tensor, nn

from vinl.policies.networks import PolicyNetwork


class TinyWalker(PolicyNetwork):
    """Proprioception, the mean depth of each image column and a counter to joint actions."""

    def __init__(self, height: int = 4, width: int = 6, actions: int = 12) -> None:
        super().__init__()
        self.arguments = {"height": height, "width": width, "actions": actions}
        self.image: tuple[int, int] | None = (height, width)
        self.observation_size, self.action_size = 48, actions
        self.head = nn.Linear(48 + width + 1, actions)

    def initial_state(self, n: int, device: object = None) -> tuple[Tensor, ...]:
        return (torch.ones(1, n, 1, device=device),)  # type: ignore[arg-type]

    def forward(
        self, depth: Tensor, vector: Tensor, state: tuple[Tensor, ...], fresh: Tensor
    ) -> tuple[Tensor, tuple[Tensor, ...]]:
        count = torch.where(fresh[-1][None, :, None], 0.0, state[0]) + 1.0
        inputs = torch.cat([vector[-1], depth[-1].mean(1), count[0] / 100], -1)
        return self.head(inputs)[None], (count,)


class TinyGuide(PolicyNetwork):
    """Turns to the goal, walks when it lies ahead, and slows down before what the middle of the image shows."""

    def __init__(self, height: int = 8, width: int = 12) -> None:
        super().__init__()
        self.arguments = {"height": height, "width": width}
        self.image: tuple[int, int] | None = (height, width)
        self.observation_size, self.action_size = 5, 2
        self.gain = nn.Parameter(torch.ones(1))
        self.seen: list[tuple[Tensor, Tensor, Tensor]] = []

    def initial_state(self, n: int, device: object = None) -> tuple[Tensor, ...]:
        return ()

    def forward(
        self, depth: Tensor, vector: Tensor, state: tuple[Tensor, ...], fresh: Tensor
    ) -> tuple[Tensor, tuple[Tensor, ...]]:
        self.seen.append((depth.clone(), vector.clone(), fresh.clone()))
        ahead, left = vector[..., 1], vector[..., 2]
        near = depth[..., depth.shape[2] // 2, depth.shape[3] // 2]
        speed = torch.where((ahead > 0.8) & (near > 0.02), 0.6, -1.0) * self.gain
        return torch.stack([speed, (2 * torch.atan2(left, ahead)).clamp(-2, 2)], -1), ()
