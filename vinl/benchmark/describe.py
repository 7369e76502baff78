"""What an evaluation was made with, as plain data: digests tell apart what has the same name."""

from __future__ import annotations

import hashlib
import json
import platform
from dataclasses import asdict
from importlib.metadata import PackageNotFoundError, version
from typing import Any

import numpy as np
from torch import nn

from vinl.evaluation.learned_navigator import LearnedNavigator
from vinl.evaluation.navigator import ORACLE, Navigator
from vinl.evaluation.oracle import OracleNavigator
from vinl.policies.policy import Policy
from vinl.world.floorplan import FloorPlan

_PACKAGES = ("vinl", "mujoco", "numpy", "scipy", "scikit-image", "torch", "warp-lang")


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


def describe_navigator(navigator: Navigator) -> dict[str, Any]:
    """Which navigator it was: the policy, or the name alone."""
    if isinstance(navigator, LearnedNavigator):
        return describe_policy(navigator.policy)
    if isinstance(navigator, OracleNavigator):
        return {"name": ORACLE}
    return {"name": getattr(navigator, "name", type(navigator).__name__)}


def describe_plan(plan: FloorPlan) -> dict[str, Any]:
    """Which floor plan it was: walls, furniture and the inside, not where its file lay."""
    digest = hashlib.sha256()
    for rows in (plan.walls.rows, plan.furniture.rows):
        digest.update(np.ascontiguousarray(rows, np.float64).tobytes() + b"|")
    frame = plan.frame
    digest.update(repr((frame.x0, frame.y0, frame.resolution, frame.shape)).encode())
    digest.update(np.packbits(plan.inside).tobytes())
    return {"name": plan.name, "source": plan.source, "sha256": digest.hexdigest()}


def digest_weights(network: nn.Module) -> str:
    """SHA-256 of all weights, by name."""
    digest = hashlib.sha256()
    for name, weight in sorted(network.state_dict().items()):
        digest.update(name.encode() + weight.detach().cpu().contiguous().numpy().tobytes())
    return digest.hexdigest()


def describe_environment() -> dict[str, str]:
    """Versions that figures may depend on."""
    return {
        "python": platform.python_version(),
        "machine": f"{platform.system()} {platform.machine()}",
        **list_packages(),
    }


def list_packages() -> dict[str, str]:
    """Versions of the packages that figures may depend on."""
    found = {}
    for name in _PACKAGES:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            continue
    return found
