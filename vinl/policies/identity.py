"""Which policy it was: digests tell apart what has the same name."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

from torch import Tensor, nn

from vinl.policies.policy import Policy


def describe_policy(policy: Policy) -> dict[str, Any]:
    """Which policy it was: the digests tell two cards, and two trainings, of the same name apart.

    What was measured of a policy is no part of it: a run goes on when its card got new figures meanwhile.
    """
    card = policy.card
    itself = {name: value for name, value in asdict(card).items() if name != "evaluation"}
    digest = hashlib.sha256(json.dumps(itself, sort_keys=True).encode()).hexdigest()
    known = {
        "name": card.name,
        "kind": card.kind,
        "card_sha256": digest,
        "samples": card.samples,
        "commit": card.commit,
    }
    network = getattr(policy, "network", None)
    return known | ({"weights_sha256": digest_weights(network)} if isinstance(network, nn.Module) else {})


def digest_weights(network: nn.Module) -> str:
    """SHA-256 of all weights of a network, see ``digest_tensors``."""
    return digest_tensors(network.state_dict())


def digest_tensors(weights: Mapping[str, Tensor]) -> str:
    """SHA-256 of weights, by name: in single precision, as ``load_policy`` gives them."""
    digest = hashlib.sha256()
    for name, weight in sorted(weights.items()):
        digest.update(name.encode() + weight.detach().cpu().float().contiguous().numpy().tobytes())
    return digest.hexdigest()
