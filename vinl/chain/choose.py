"""The policies that are taken where none is named."""

from __future__ import annotations

from pathlib import Path

from vinl.config.errors import InputError
from vinl.evaluation.senses import check_senses
from vinl.policies.io import list_policies, load_policy
from vinl.policies.policy import Policy

BEST_FIRST = ("loco", "teacher", "rough")
"""Shipped locomotors, the one that is wanted most first."""


def best_locomotor() -> str:
    """Name of the shipped locomotor that is taken where none is named.

    Raises:
        InputError: none is shipped.
    """
    shipped = list_policies()
    for name in BEST_FIRST:
        if name in shipped:
            return name
    raise InputError("no locomotor is shipped with this version; give a policy folder")


def choose_locomotor(locomotor: str | Path | Policy | None) -> Policy:
    """The policy itself, the one of that name, or the best shipped one.

    Raises:
        InputError: there is none, or it is no locomotor.
    """
    if locomotor is None:
        locomotor = best_locomotor()
    policy = load_policy(locomotor) if isinstance(locomotor, (str, Path)) else locomotor
    check_senses(policy)
    return policy
