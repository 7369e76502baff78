"""The mean of two policies' weights: what each of them learned since they parted, a share of both."""

from __future__ import annotations

import copy
from dataclasses import replace

import torch

from vinl.config.errors import InputError
from vinl.policies.card import PolicyCard
from vinl.policies.depth_policy import DepthPolicy
from vinl.policies.networks import PolicyNetwork
from vinl.policies.policy import LocomotionPolicy


def average_policies(
    first: LocomotionPolicy | DepthPolicy, second: LocomotionPolicy | DepthPolicy, share: float
) -> tuple[PolicyNetwork, PolicyCard]:
    """The weights (1 - share) x first + share x second.

    It works for policies of which one was trained on from the other, or both from a third: they then lie in one valley
    of the loss, and what is between them is often better than both (Wortsman et al. 2022, "Model soups").

    Args:
        first, second: of one network, observation and action. Their cameras may stand a little apart (the network's
            image size is the same), and their commands may be bent otherwise; the second's camera and detour are kept.
        share: of the second, between 0 and 1.

    Returns:
        The network, and the second's card with both shares in ``training["averaged"]`` and without measurements.

    Raises:
        InputError: the share is out of range, or the policies differ in more than their weights.
    """
    if not 0 <= share <= 1:
        raise InputError(f"the share of {second.card.name} must lie between 0 and 1, got {share:g}")
    for what in ("kind", "network", "observation", "action"):
        if _read(first.card, what) != _read(second.card, what):
            raise InputError(f"{first.card.name} and {second.card.name} differ in {what}: they have no mean")
    network, weights = copy.deepcopy(second.network), first.network.state_dict()
    with torch.no_grad():
        for name, tensor in network.state_dict().items():
            tensor.copy_((1 - share) * weights[name] + share * tensor)
    parts = [
        {"policy": policy.card.name, "samples": policy.card.samples, "share": part}
        for policy, part in ((first, round(1 - share, 6)), (second, share))
    ]
    card = replace(second.card, training=second.card.training | {"averaged": parts}, evaluation={})
    return network, card


def _read(card: PolicyCard, what: str) -> object:
    """A field of the card; of the observation all but how commands are bent, which is no part of the network."""
    if what != "observation":
        return getattr(card, what)
    return [{key: value for key, value in row.items() if key != "detour"} for row in card.observation]
