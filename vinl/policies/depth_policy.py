"""A policy that sees: a depth image and a vector in, an action out, its memory inside."""

from __future__ import annotations

from typing import Any, Protocol, cast, runtime_checkable

import numpy as np
import torch
from jaxtyping import Bool, Float
from torch import Tensor

from vinl.config.errors import InputError
from vinl.config.loader import build_config
from vinl.policies.card import PolicyCard
from vinl.policies.depth_memory import State
from vinl.policies.networks import PolicyNetwork
from vinl.policies.policy import A, DatesImages
from vinl.robot.cameras import Camera
from vinl.sensing.preparation import prepare_depth


@runtime_checkable
class DepthNetwork(Protocol):
    """What a ``PolicyNetwork`` needs to be run by ``DepthPolicy``.

    Attributes:
        image: height and width of the depth image [pixels]; None for a network that is blind.
    """

    image: tuple[int, int] | None

    def initial_state(self, n: int, device: Any = None) -> State:
        """The memory of n robots that have seen nothing."""
        ...

    def forward(self, depth: Any, vector: Any, state: State, fresh: Any) -> tuple[Any, State]:
        """Actions (t, n, a) and the last state, from depth (t, n, H, W) in [0, 1], vectors (t, n, k), the state before
        and fresh (t, n): an episode begins with this step."""
        ...


@runtime_checkable
class PlansFootholds(Protocol):
    """A network whose memory holds where the feet are to come down."""

    def footholds(self, state: State) -> Float[Tensor, "n 4 3"]:
        """In the robots' heading frames [m]."""
        ...


@runtime_checkable
class KeepsGrid(Protocol):
    """A network whose memory may hold an occupancy grid."""

    def occupied(self, state: State) -> list[Float[Tensor, "_ 2"]]:
        """For each robot the cells that something stands on, in its heading frame [m]; empty without a grid."""
        ...


class DepthPolicy:
    """Observations (n, k) and depth images (n, H, W) to actions (n, a), without noise, on the device of its network.

    It remembers the past of n robots. Rows keep their robot from call to call; ``reset`` says who starts anew.

    Attributes:
        camera: the camera that it was trained with, rebuilt from the card; None if it is blind.
        dates_images: whether it makes use of the age of an image.
    """

    def __init__(self, network: PolicyNetwork, card: PolicyCard) -> None:
        """Takes the network over: it is put into evaluation mode and its gradients are switched off.

        Raises:
            InputError: network and card do not agree on the image.
        """
        self.card = card
        self.network = network.eval().requires_grad_(False)
        self.camera = read_camera(card, cast(DepthNetwork, network).image)
        self.dates_images: bool = getattr(network, "dates_images", False)
        self.device = next(network.parameters()).device
        self._state: State = ()
        self._fresh = torch.zeros(0, dtype=torch.bool, device=self.device)

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.card.name}, {self.card.kind}, {self.card.network['class']})"

    def reset(self, which: int | Bool[np.ndarray, " n"] | Bool[Tensor, " n"]) -> None:
        """Forget the past of all of n robots, or of those that a mask (n,) marks.

        Raises:
            ValueError: a mask of another length than there are robots.
        """
        if isinstance(which, int):
            self._begin(which)
            return
        mask = torch.as_tensor(which, device=self.device)
        if not len(self._fresh):
            self._begin(len(mask))
        if len(mask) != len(self._fresh):
            raise ValueError(f"{self.card.name} remembers {len(self._fresh)} robots, the mask has {len(mask)}")
        self._fresh = self._fresh | mask

    def act(self, observation: Float[A, "n observation"], depth: Any = None, age: Any = None) -> Float[A, "n actions"]:
        """Actions for scaled observations and what the camera sees.

        Args:
            observation: (n, k) in the order of the card's observation table, numpy or torch, any float type.
            depth: (n, height, width) of ``camera`` [m], numpy or torch, 0 or less for a pixel without a return; None if
                the policy is blind.
            age: (n,) how long ago the images were taken [s], in as far as ``dates_images``; None: now.

        Returns:
            (n, a) of the observation's kind and on its device; numpy as float32.

        Raises:
            ValueError: another shape than the network takes, or other robots than before without a ``reset``.
        """
        n, wanted = len(observation), self.network.observation_size
        if observation.ndim != 2 or observation.shape[1] != wanted:
            raise ValueError(f"{self.card.name} observes (n, {wanted}), got {tuple(observation.shape)}")
        if not len(self._fresh):
            self._begin(n)
        if n != len(self._fresh):
            raise ValueError(f"{self.card.name} remembers {len(self._fresh)} robots, got {n}; call reset({n}) first")
        with torch.no_grad():
            image = self._see(depth, n)
            vector = torch.as_tensor(observation, dtype=torch.float32, device=self.device)
            ages = (x[None] for x in read_ages(self, age, self.device))
            action, self._state = self.network(image[None], vector[None], self._state, self._fresh[None], *ages)
            self._fresh = torch.zeros_like(self._fresh)
            if isinstance(observation, Tensor):
                return action[0].to(observation.device, observation.dtype)
            return action[0].cpu().numpy()

    def footholds(self) -> dict[str, Float[np.ndarray, "n 4 3"]]:
        """Where the feet come down next, as ``predicted``, in the heading frames that the robots had in the last step
        [m]; nothing if the network plans no footholds, or before the first step."""
        if not isinstance(self.network, PlansFootholds) or not len(self._fresh) or self._fresh.any():
            return {}
        return {"predicted": self.network.footholds(self._state).cpu().numpy()}

    def occupied(self) -> list[Float[np.ndarray, "_ 2"]]:
        """For each robot the cells that something stands on by the network's grid, in the heading frame that the robot
        had in the last step [m]; nothing if it keeps no grid, or before the first step."""
        if not isinstance(self.network, KeepsGrid) or not len(self._fresh) or self._fresh.any():
            return []
        return [places.cpu().numpy() for places in self.network.occupied(self._state)]

    def _begin(self, n: int) -> None:
        self._state = cast(DepthNetwork, self.network).initial_state(n, self.device)
        self._fresh = torch.ones(n, dtype=torch.bool, device=self.device)

    def _see(self, depth: Any, n: int) -> Float[Tensor, "n height width"]:
        """Depth as the network takes it: normalised by the camera record, pixels without a return dealt with."""
        if self.camera is None:
            return torch.zeros(n, 1, 1, device=self.device)
        shape = (n, self.camera.height, self.camera.width)
        if depth is None or tuple(depth.shape) != shape:
            raise ValueError(
                f"{self.card.name} sees depth {shape}, got {None if depth is None else tuple(depth.shape)}"
            )
        return prepare_depth(self.camera, torch.as_tensor(depth, dtype=torch.float32, device=self.device))


def read_ages(policy: DatesImages, age: Any, device: torch.device) -> tuple[Float[Tensor, " n"], ...]:
    """The ages of images as a network's further argument: none where they are not known, or not asked for."""
    if age is None or not policy.dates_images:
        return ()
    return (torch.as_tensor(age, dtype=torch.float32, device=device),)


def read_camera(card: PolicyCard, image: tuple[int, int] | None) -> Camera | None:
    """The camera of a card, as the network needs it; None for a blind network.

    Args:
        card: its ``camera`` is a record as ``Camera.describe`` gives it.
        image: height and width that the network takes.

    Raises:
        InputError: the record is missing or broken, or its image size or its planes are not the network's.
    """
    if image is None:
        return None
    source = f"policy {card.name}, camera"
    if card.camera is None:
        raise InputError(f"{source}: the network sees {image[1]} x {image[0]} pixels, the card has no camera")
    camera = build_config(Camera, card.camera, source=source)
    if (camera.height, camera.width) != tuple(image):
        raise InputError(
            f"{source}: the image of the card is {camera.width} x {camera.height} pixels, "
            f"the network takes {image[1]} x {image[0]}"
        )
    own = card.network.get("camera")
    if own is not None and build_config(Camera, own, source="network: camera") != camera:
        raise InputError(f"{source}: it is not the one that the network maps the ground with")
    marks = own is not None or int(card.network.get("channels", 1)) == 2
    if (camera.missing == "plane") != marks:
        raise InputError(
            f"{source}: missing is {camera.missing!r}, but the network takes images with{'' if marks else 'out'} marks "
            f"where nothing returned, which plane gives"
        )
    return camera
