"""The locomotor that sees: depth and proprioception become the code that the teacher's actor is fed with."""

from __future__ import annotations

from collections.abc import Sequence

import torch
from jaxtyping import Bool, Float
from torch import Tensor, nn

from vinl.policies.depth_memory import DepthMemory, State
from vinl.policies.networks import PolicyNetwork, mlp
from vinl.robot.observation import PROPRIOCEPTION_SIZE


class DepthActor(PolicyNetwork):
    """CNN and memory in place of the teacher's height scan [paper III-C]; deterministic.

    Parameters are named ``memory.*`` (image and past), ``head.*`` (linear to the code) and ``actor.*`` (the teacher's).

    Attributes:
        image: height and width that it takes [pixels]; None: it is blind.
    """

    def __init__(
        self,
        vision: str = "cnn",
        height: int = 36,
        width: int = 64,
        visual: int = 32,
        hidden: int = 64,
        layers: int = 2,
        memory: str = "lstm",
        planes: int = 32,
        proprioception: int = PROPRIOCEPTION_SIZE,
        code: int = 32,
        actor: Sequence[int] = (512, 256, 128),
        actions: int = 12,
    ) -> None:
        """Sizes as in ``DepthMemory``; ``actor`` are the widths of the actor's hidden layers, the teacher's."""
        super().__init__()
        self.keep_arguments(locals())
        self.observation_size, self.action_size = proprioception, actions
        self.memory = DepthMemory(vision, height, width, proprioception, visual, hidden, layers, memory, planes)
        self.image = self.memory.image
        self.head = nn.Linear(hidden, code)
        self.actor = mlp([proprioception + code, *actor, actions], nn.ELU)

    def initial_state(self, n: int, device: torch.device | str | None = None) -> State:
        """The state of n robots that remember nothing."""
        return self.memory.initial_state(n, device)

    def forward(
        self,
        depth: Float[Tensor, "t n height width"] | None,
        vector: Float[Tensor, "t n k"],
        state: State,
        fresh: Bool[Tensor, "t n"],
    ) -> tuple[Float[Tensor, "t n actions"], State]:
        """Actions of t steps in a row.

        Args:
            depth: (t, n, H, W) in [0, 1]: normalised by the camera record of the card.
            vector: (t, n, 48) scaled proprioception, the observation table without the height scan.
            state: before the first step.
            fresh: (t, n) an episode begins with this step.

        Returns:
            (t, n, 12) actions, and the state after the last step.
        """
        features, state = self.memory(depth, vector, state, fresh)
        return self.actor(torch.cat([vector, self.head(features)], -1)), state
