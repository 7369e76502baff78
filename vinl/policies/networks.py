"""The networks of the shipped policies, and the registry that rebuilds one from its policy card."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Sequence
from inspect import signature
from itertools import pairwise
from typing import Any

from jaxtyping import Float
from torch import Tensor, nn

from vinl.config.errors import InputError
from vinl.config.loader import build_config, closest
from vinl.gait.config import GaitConfig
from vinl.gait.observation import STEPPING_TABLE
from vinl.policies.symmetry import SymmetricMLP

NETWORKS: dict[str, type[PolicyNetwork]] = {}
"""Class name to class: what a policy card may name."""

ELSEWHERE = {"NavActor": "vinl.policies.nav_actor", "SteppingActor": "vinl.policies.stepping_actor"}
"""Networks that register when their module is imported, and the module."""


class PolicyNetwork(nn.Module):
    """A network that a policy card can describe and rebuild. Subclasses register themselves by their class name.

    Attributes:
        observation_size: numbers in.
        action_size: numbers out.
        arguments: plain arguments of the constructor.
    """

    observation_size: int
    action_size: int
    arguments: dict[str, Any]

    def __init_subclass__(cls, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        NETWORKS[cls.__name__] = cls

    def keep_arguments(self, local: dict[str, Any]) -> None:
        """Keep what the constructor was called with.

        Args:
            local: ``locals()`` at its start. What is None or False is left out: cards from before it existed lack it.
        """
        self.arguments = {
            name: list(value) if isinstance(value, list | tuple) else value
            for name in signature(type(self)).parameters
            if (value := local[name]) is not None and value is not False
        }

    def describe(self) -> dict[str, Any]:
        """What ``build_network`` needs: the class name and the constructor's arguments, as plain data."""
        return {"class": type(self).__name__, **self.arguments}


class StepActor(PolicyNetwork):
    """The deterministic locomotion actor of planned footholds.

    What it knows of the ground is where its feet shall go. Parameters are named ``actor.*``.
    """

    def __init__(
        self, gait: dict[str, Any] | None = None, actor: Sequence[int] = (512, 256, 128), actions: int = 12
    ) -> None:
        """``gait`` are the fields of its ``GaitConfig``, ``actor`` the widths of the hidden layers."""
        super().__init__()
        gait = dict(gait or {})
        self.keep_arguments(locals())
        self.observation_size, self.action_size = STEPPING_TABLE.size, actions
        build_config(GaitConfig, gait, source="network: gait")  # refuses what no gait can be
        self.actor = step_layers(actor, actions)

    def forward(self, observation: Float[Tensor, "n observation"]) -> Float[Tensor, "n actions"]:
        """Scaled observations in the order of ``gait.observation.STEPPING_TABLE`` to actions."""
        return self.actor(observation)


def step_layers(hidden: Sequence[int], actions: int) -> SymmetricMLP:
    """The layers that follow a gait: from ``STEPPING_TABLE`` through the widths ``hidden`` to ``actions``."""
    return SymmetricMLP(*mlp([STEPPING_TABLE.size, *hidden, actions], nn.ELU))


def mlp(sizes: Sequence[int], activation: Callable[[], nn.Module]) -> nn.Sequential:
    """Linear layers through ``sizes`` with ``activation`` between them and none at the end."""
    layers: list[nn.Module] = []
    for k, (size_in, size_out) in enumerate(pairwise(sizes)):
        layers += [activation()] if k else []
        layers.append(nn.Linear(size_in, size_out))
    return nn.Sequential(*layers)


def build_network(description: dict[str, Any], source: str = "policy card") -> PolicyNetwork:
    """The network that ``PolicyNetwork.describe`` described, with fresh weights.

    Raises:
        InputError: unknown class, or arguments that it does not take; ``source`` names the card in the message.
    """
    arguments = dict(description)
    name = arguments.pop("class", None)
    if isinstance(name, str) and name in ELSEWHERE:
        importlib.import_module(ELSEWHERE[name])
    if not isinstance(name, str) or name not in NETWORKS:
        known = sorted({*NETWORKS, *ELSEWHERE})
        near = closest(str(name), known)
        raise InputError(f"{source}: unknown network class {name!r}{near}; known: {', '.join(known)}")
    for key, value in arguments.items():
        if isinstance(value, str | bool | dict):  # names, switches, settings: the class knows which there are
            continue
        for size in value if isinstance(value, list) else [value]:
            if isinstance(size, bool) or not isinstance(size, int) or size < 1:
                raise InputError(f"{source}: network size {key} must be a positive whole number, got {size!r}")
    try:
        return NETWORKS[name](**arguments)
    except (TypeError, ValueError, RuntimeError) as error:
        reason = str(error).splitlines()[0]
        raise InputError(f"{source}: network {name} cannot be built from {arguments}: {reason}") from None
