"""One control step of one robot as a function of tensors alone: what a policy remembers goes in and comes out."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, cast

import torch
from torch import Tensor, nn

from vinl.config.errors import InputError
from vinl.policies.depth_policy import DepthNetwork, DepthPolicy
from vinl.policies.policy import LocomotionPolicy
from vinl.sensing.preparation import prepare_depth

OBSERVATION, DEPTH, AGE, ACTION = "observation", "depth", "age", "action"
"""Names of the inputs and the output that are not memory."""

MEMORY = ("hidden", "cell")
"""Names of what an LSTM remembers."""

BEGUN = "begun"
"""Name of the state that tells the first step of an episode, 0, from those after it, 1."""

NEXT = "_next"
"""The output that is to be given back as the input ``hidden`` is called ``hidden_next``."""


@dataclass(frozen=True, eq=False)
class StateInput:
    """What a policy remembers from step to step, an input and an output of the file: the input's name, which ``NEXT``
    is added to for the output, and the value that an episode begins with, shaped as for one robot."""

    name: str
    start: Tensor


class Step(nn.Module):
    """A policy's network for one robot: image preparation inside, memory outside.

    A network that remembers more than an LSTM does, such as its gait, lists all of it in ``state_names`` in the order
    of its ``initial_state``; it then becomes inputs and outputs like any memory. What such a network begins with may
    follow from what it observes first, so that it is told whether an episode begins: by one more state, ``BEGUN``.

    Attributes:
        states: what it remembers; empty for a policy without memory.
        camera: whose depth it takes; None for one that sees none.
        dates_images: whether it takes the age of the image too.

    Raises:
        InputError: the network remembers something that has no name.
    """

    def __init__(self, policy: LocomotionPolicy | DepthPolicy) -> None:
        super().__init__()
        self.network = policy.network
        self.states: tuple[StateInput, ...] = ()
        self.camera = policy.camera
        self._sees, self._told = isinstance(policy, DepthPolicy), False
        self.dates_images = policy.dates_images
        if not self._sees:
            return
        network = cast(DepthNetwork, policy.network)
        start = network.initial_state(1, policy.device)
        self._told = hasattr(network, "state_names")
        names = getattr(network, "state_names", MEMORY[: len(start)])
        if len(names) != len(start):
            raise InputError(f"{policy.card.name} remembers {len(start)} things, of which {len(names)} have a name")
        self.states = tuple(StateInput(*pair) for pair in zip(names, start, strict=True))
        if self._told:
            self.states += (StateInput(BEGUN, torch.zeros(1, 1, device=policy.device)),)

    @property
    def inputs(self) -> tuple[str, ...]:
        """Names of the inputs in their order."""
        image = ((DEPTH,) if self.camera else ()) + ((AGE,) if self.dates_images else ())
        return (OBSERVATION, *image, *(state.name for state in self.states))

    @property
    def outputs(self) -> tuple[str, ...]:
        """Names of the outputs in their order."""
        return (ACTION, *(state.name + NEXT for state in self.states))

    def example(self) -> tuple[Tensor, ...]:
        """Inputs of the right shapes, for the tracer."""
        observation = torch.zeros(1, self.network.observation_size)
        depth = (torch.ones(1, self.camera.height, self.camera.width),) if self.camera else ()
        age = (torch.zeros(1),) if self.dates_images else ()
        return (observation, *depth, *age, *(state.start for state in self.states))

    def forward(self, observation: Any, *rest: Any) -> tuple[Any, ...]:
        """The action (1, a) and the states after it, from the observation (1, k), depth (1, height, width) [m] if the
        policy sees and its age (1,) [s] if that is asked for, and the states before."""
        if not self._sees:
            return (self.network(observation),)
        image, states = observation[:, :1, None], rest
        if self.camera is not None:
            image, states = prepare_depth(self.camera, rest[0]), rest[1:]
        if not self._told:  # whoever begins an episode gives the states of the start, which is all that a memory needs
            fresh = torch.zeros(1, 1, dtype=torch.bool)
            action, after = self.network(image[None], observation[None], states, fresh)
            return (action[0], *after)
        *states, begun = states
        age = (states.pop(0)[None],) if self.dates_images else ()
        action, after = self.network(image[None], observation[None], tuple(states), begun < 0.5, *age)
        return (action[0], *after, (begun + 1.0).clip(max=1.0))
