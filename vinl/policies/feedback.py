"""Velocity feedback: a policy that answers what is missing from a command more than it learned to."""

from __future__ import annotations

import copy
import math
from dataclasses import replace

import torch
from torch import nn

from vinl.config.errors import InputError
from vinl.policies.card import PolicyCard
from vinl.policies.depth_policy import DepthPolicy
from vinl.policies.networks import PolicyNetwork
from vinl.policies.policy import LocomotionPolicy

SPEEDS = (("base_linear_velocity", 0), ("base_linear_velocity", 1), ("base_angular_velocity", 2))
"""The rows and places of a locomotor's table that observe what the three numbers of ``command`` ask for."""


def add_feedback(
    policy: LocomotionPolicy | DepthPolicy, forward: float, sideways: float, yaw_rate: float
) -> tuple[PolicyNetwork, PolicyCard]:
    """The policy as if it observed ``command + gain * (command - velocity)`` in the place of the command.

    All of it is observed already, so that the gains become part of the weights of the actor's first layer, and the
    policy is run as any other. What a policy learned to do about a command is a compromise with effort and smoothness;
    this asks for more where the robot lags behind, and for nothing where it does not. The noise of an estimated
    velocity is amplified alike, and large gains shake the robot.

    Args:
        policy: a locomotor. If it has detours, the gains are for the bent command.
        forward, sideways, yaw_rate: gains, none below 0 [1].

    Returns:
        The network, and the card with the gains in ``training["feedback"]`` and without measurements.

    Raises:
        InputError: a gain is negative or not finite, the policy is no locomotor or has feedback already.
    """
    card, gains = policy.card, (forward, sideways, yaw_rate)
    if not all(math.isfinite(gain) and gain >= 0 for gain in gains):
        raise InputError(f"feedback gains must be finite and not negative, got {forward:g}, {sideways:g}, {yaw_rate:g}")
    if card.kind != "locomotion":
        raise InputError(f"{card.name} is a {card.kind} policy: only locomotors follow a velocity")
    if "feedback" in card.training:
        raise InputError(f"{card.name} has feedback already: {card.training['feedback']}")
    network = copy.deepcopy(policy.network)
    layer = network.get_submodule("actor.0")
    assert isinstance(layer, nn.Linear)  # the actor of every locomotor begins with the table
    commands = _find("command", card)
    with torch.no_grad():
        for axis, (gain, (row, place)) in enumerate(zip(gains, SPEEDS, strict=True)):
            (column, scale), (measured, unit) = commands[axis], _find(row, card)[place]
            weight = layer.weight[:, column].clone()
            layer.weight[:, column] += gain * weight
            layer.weight[:, measured] -= gain * weight * (scale / unit)
    names = ("forward", "sideways", "yaw_rate")
    training = card.training | {"feedback": dict(zip(names, gains, strict=True))}
    return network, replace(card, training=training, evaluation={})


def _find(name: str, card: PolicyCard) -> list[tuple[int, float]]:
    """Column and scale of each number of a row of the card's table."""
    first = 0
    for row in card.observation:
        size = int(row["size"])
        if row["name"] == name:
            scales = list(row["scale"]) * (size if len(row["scale"]) == 1 else 1)
            return [(first + k, float(scale)) for k, scale in enumerate(scales)]
        first += size
    raise InputError(f"{card.name} does not observe {name}")
