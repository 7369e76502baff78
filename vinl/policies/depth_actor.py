"""The locomotor that sees: depth and proprioception become the code that the teacher's actor is fed with."""

from __future__ import annotations

from collections.abc import Sequence

import torch
from jaxtyping import Bool, Float
from torch import Tensor, nn

from vinl.policies.depth_memory import DepthMemory, State
from vinl.policies.networks import PolicyNetwork, mlp
from vinl.robot.observation import PROPRIOCEPTION_SIZE, SCALE

DETOUR = 0.1
"""Unit of a detour in the code [m/s, rad/s]. No training has detours any more: what is here of them goes with the
weights of ``loco`` that have such a card."""

_COMMAND = slice(10, 12)
"""Sideways speed and yaw rate of the command in the observation table."""

_BEND = tuple(DETOUR * float(scale) for scale in SCALE[_COMMAND])


class DepthActor(PolicyNetwork):
    """CNN and memory in place of the teacher's height scan [paper III-C]; deterministic.

    Parameters are named ``memory.*`` (image and past), ``head.*`` (linear to the code) and ``actor.*`` (the teacher's).

    Attributes:
        image: height and width that it takes [pixels]; None: it is blind.
        detour: whether the teacher's commands were bent (``vinl.sensing.detour``). The code then ends with what has to
            be added to the command, sideways and turning, in units of ``DETOUR``.
        code: size of the code, the detour included.
        bend: (2,) what one unit of the detour adds to the observed command.
    """

    bend: Tensor

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
        detour: bool = False,
    ) -> None:
        """Sizes as in ``DepthMemory``; ``actor`` are the widths of the actor's hidden layers, the teacher's; ``code``
        is without the detour."""
        super().__init__()
        self.keep_arguments(locals())
        self.observation_size, self.action_size, self.detour = proprioception, actions, detour
        self.code = code + 2 * detour
        # No weight, but on the device: to copy it there at every step would be to wait for the device. It has its
        # numbers even where networks are built without any (``load_policy``).
        self.register_buffer("bend", torch.tensor(_BEND, device="cpu"), persistent=False)
        self.memory = DepthMemory(vision, height, width, proprioception, visual, hidden, layers, memory, planes)
        self.image = self.memory.image
        self.head = nn.Linear(hidden, self.code)
        self.actor = mlp([proprioception + code, *actor, actions], nn.ELU)

    def initial_state(self, n: int, device: torch.device | str | None = None) -> State:
        """The state of n robots that remember nothing."""
        return self.memory.initial_state(n, device)

    def encode(
        self,
        depth: Float[Tensor, "t n height width"] | None,
        vector: Float[Tensor, "t n k"],
        state: State,
        fresh: Bool[Tensor, "t n"],
    ) -> tuple[Float[Tensor, "t n code"], State]:
        """The code alone, and the state after the last step; arguments as in ``forward``."""
        features, state = self.memory(depth, vector, state, fresh)
        return self.head(features), state

    def act(self, vector: Float[Tensor, "*n k"], code: Float[Tensor, "*n code"]) -> Float[Tensor, "*n actions"]:
        """Actions of a code, the student's or the teacher's."""
        if self.detour:
            code, bend = code[..., :-2], code[..., -2:] * self.bend
            before, command, behind = vector.tensor_split((_COMMAND.start, _COMMAND.stop), -1)
            vector = torch.cat([before, command + bend, behind], -1)
        return self.actor(torch.cat([vector, code], -1))

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
        code, state = self.encode(depth, vector, state, fresh)
        return self.act(vector, code), state
