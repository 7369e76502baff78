"""The navigator's network: depth image, goal and previous action to a forward speed and a yaw rate."""

from __future__ import annotations

import torch
from jaxtyping import Bool, Float
from torch import Tensor, nn

from vinl.policies.depth_memory import DepthMemory, State
from vinl.policies.networks import PolicyNetwork

GOAL_SIZE, PREVIOUS_SIZE = 3, 2
"""Numbers that say where the goal is (distance / 5 m, cosine and sine of the bearing), and of the last action."""

OBSERVATION_SIZE, ACTION_SIZE = GOAL_SIZE + PREVIOUS_SIZE, 2

_MEAN_GAIN = 0.01
"""Gain of the last layer: an untrained navigator asks for the middle of its ranges [ViNL code]."""


class NavActor(PolicyNetwork):
    """The deterministic navigator [ViNL resnet_policy.py].

    The image becomes ``visual`` numbers, goal and previous action ``embedding`` numbers each; all go into the memory,
    whose feature a linear layer and tanh turn into the two actions.

    Args:
        vision: ``"resnet18"``, ``"cnn"`` or ``"none"`` (blind).
        height, width: of the depth image [pixels].
        visual: numbers that the image becomes.
        embedding: numbers that goal and previous action become, each.
        memory: ``"lstm"`` or ``"mlp"``.
        planes: channels of the ResNet's first stage.
        previous: numbers on the last step: 2 of the action or the motion, 4 of both.
        channels: of the image: 1, or 2 with one for the pixels without a return.

    Attributes:
        image: (height, width) [pixels], or None if blind.
        feature_size: numbers that ``look`` returns.
    """

    observation_size = OBSERVATION_SIZE
    action_size = ACTION_SIZE

    def __init__(
        self,
        vision: str = "resnet18",
        height: int = 48,
        width: int = 80,
        visual: int = 512,
        embedding: int = 32,
        hidden: int = 512,
        layers: int = 2,
        memory: str = "lstm",
        planes: int = 32,
        previous: int = PREVIOUS_SIZE,
        channels: int = 1,
    ) -> None:
        super().__init__()
        self.observation_size = GOAL_SIZE + previous
        self.keep_arguments(locals())
        self.goal = nn.Linear(GOAL_SIZE, embedding)
        self.previous = nn.Linear(previous, embedding)
        self.memory = DepthMemory(
            vision, height, width, 2 * embedding, visual, hidden, layers, memory, planes, channels
        )
        self.image, self.feature_size = self.memory.image, hidden
        self.mean = nn.Linear(hidden, ACTION_SIZE)
        nn.init.orthogonal_(self.mean.weight, _MEAN_GAIN)
        nn.init.zeros_(self.mean.bias)

    def initial_state(self, n: int, device: torch.device | str | None = None) -> State:
        """The memory of n robots that have seen nothing."""
        return self.memory.initial_state(n, device)

    def forward(
        self,
        depth: Float[Tensor, "t n height width"] | None,
        vector: Float[Tensor, "t n k"],
        state: State,
        fresh: Bool[Tensor, "t n"],
    ) -> tuple[Float[Tensor, "t n 2"], State]:
        """Actions of t steps in a row.

        Args:
            depth: (t, n, H, W) in [0, 1]; not looked at when blind.
            vector: (t, n, k): distance to the goal / 5 m, cosine and sine of its bearing, previous action or motion or
                both.
            fresh: (t, n) an episode begins with this step: its state is zeroed before it.

        Returns:
            (t, n, 2) in [-1, 1]: forward speed is (a0 + 1) / 2 m/s, yaw rate a1 x pi/3 rad/s; and the last state.
        """
        feature, state = self.look(depth, vector, state, fresh)
        return self.choose(feature), state

    def look(
        self,
        depth: Float[Tensor, "t n height width"] | None,
        vector: Float[Tensor, "t n k"],
        state: State,
        fresh: Bool[Tensor, "t n"],
    ) -> tuple[Float[Tensor, "t n hidden"], State]:
        """Features of t steps in a row, arguments as for ``forward``; a critic may share them."""
        parts = [self.goal(vector[..., :GOAL_SIZE]), self.previous(vector[..., GOAL_SIZE:])]
        return self.memory(depth, torch.cat(parts, -1), state, fresh)

    def choose(self, feature: Float[Tensor, "t n hidden"]) -> Float[Tensor, "t n 2"]:
        """Actions in [-1, 1] from features."""
        return torch.tanh(self.mean(feature))
