"""A policy object: what the chain calls, whatever network is inside."""

from __future__ import annotations

from typing import Any, Protocol, TypeVar, runtime_checkable

import numpy as np
import torch
from jaxtyping import Bool, Float
from torch import Tensor

from vinl.policies.card import PolicyCard
from vinl.policies.networks import PolicyNetwork
from vinl.robot.cameras import Camera

A = TypeVar("A", np.ndarray, Tensor)


@runtime_checkable
class Policy(Protocol):
    """Batched: one call acts for all robots. Recurrent state, if any, lives inside.

    Attributes:
        card: what the policy needs to be used; ``card.observation_size`` numbers are observed.
        camera: the depth camera that it sees through; ``act`` then takes depth (n, height, width) [m] as its second
            argument. None: it takes numbers alone.
    """

    card: PolicyCard
    camera: Camera | None

    def reset(self, which: int | Bool[np.ndarray, " n"] | Bool[Tensor, " n"]) -> None:
        """Forget the past of all of n robots, or of those that a mask marks."""
        ...

    def act(self, observation: Any, depth: Any = None) -> Any:
        """Actions for the observations of all robots; numpy in, numpy out; torch in, torch out."""
        ...


@runtime_checkable
class DatesImages(Policy, Protocol):
    """A policy that can be told how old an image is.

    Attributes:
        dates_images: whether it makes use of that.
    """

    dates_images: bool

    def act(self, observation: Any, depth: Any = None, age: Any = None) -> Any:
        """See ``Policy.act``; ``age`` (n,) of the images [s]."""
        ...


class LocomotionPolicy:
    """Observations (n, card.observation_size) to actions (n, 12) at 50 Hz, without noise, on the device of its
    network."""

    camera: Camera | None = None
    """It needs no camera."""

    dates_images: bool = False

    def __init__(self, network: PolicyNetwork, card: PolicyCard) -> None:
        """Takes the network over: it is put into evaluation mode and its gradients are switched off."""
        self.card = card
        self.network = network.eval().requires_grad_(False)
        self.device = next(network.parameters()).device

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.card.name}, {self.card.kind}, {self.card.network['class']})"

    def reset(self, which: int | Bool[np.ndarray, " n"] | Bool[Tensor, " n"]) -> None:
        """This policy has no memory: nothing to forget."""

    def act(self, observation: Float[A, "n observation"], depth: Any = None) -> Float[A, "n actions"]:
        """Actions for scaled observations.

        Args:
            observation: (n, card.observation_size) in the order of the card's observation table, numpy or torch, any
                float type.
            depth: left alone: this policy has no camera.

        Returns:
            (n, 12) of the same kind and on the same device; numpy as float32.

        Raises:
            ValueError: another number of columns than the network takes.
        """
        if observation.ndim != 2 or observation.shape[1] != self.network.observation_size:
            wanted = f"(n, {self.network.observation_size})"
            raise ValueError(f"{self.card.name} observes {wanted}, got {tuple(observation.shape)}")
        with torch.no_grad():
            if isinstance(observation, Tensor):
                action = self.network(observation.to(self.device, torch.float32))
                return action.to(observation.device, observation.dtype)
            tensor = torch.from_numpy(np.ascontiguousarray(observation, dtype=np.float32)).to(self.device)
            return self.network(tensor).cpu().numpy()
