"""The navigator of a name: the oracle, or a trained one."""

from __future__ import annotations

from pathlib import Path

from vinl.chain.config import EvaluationConfig
from vinl.chain.navigators.base import ORACLE, Navigator
from vinl.config.errors import InputError
from vinl.config.fields import closest
from vinl.policies.card import read_card
from vinl.policies.io import find_policy, list_policies, load_policy
from vinl.robot.aliengo import CONTROL_DT

SHIPPED = "nav"
"""The navigator that comes with the package."""


def choose_navigator(navigator: str | Path | Navigator | None, config: EvaluationConfig) -> Navigator:
    """The navigator itself, the one of that name, or the shipped one; without one, the oracle.

    Raises:
        InputError: there is none of that name, it is a policy of another kind, or it is no navigator at all.
    """
    if navigator is None:
        navigator = best_navigator()
    if isinstance(navigator, (str, Path)):
        return load_navigator(navigator, config)
    if not all(hasattr(navigator, name) for name in ("reset", "act", "camera")):
        raise InputError(
            f"a navigator is a name, a folder, or has reset, act and camera; got {type(navigator).__name__} "
            "(a function: vinl.as_navigator)"
        )
    return navigator


def best_navigator() -> str:
    """Name of the navigator that is taken where none is named."""
    return SHIPPED if SHIPPED in list_policies() else ORACLE


def load_navigator(
    name: str | Path, config: EvaluationConfig, device: str = "cpu", recovery: bool = False
) -> Navigator:
    """The oracle, or a trained navigator.

    Args:
        name: ``"oracle"``, a shipped navigation policy's name, a policy folder or the folder of a training run.
        config: how the oracle walks.
        device: of a trained navigator.
        recovery: free its robots where they are stuck (``RecoveringNavigator``); the oracle never has that.

    Raises:
        InputError: there is none of that name, or it is a policy of another kind.
    """
    if name == ORACLE:
        from vinl.chain.navigators.oracle import OracleNavigator

        if recovery:
            raise InputError("recovery frees robots of a learned navigator; the oracle has none")
        return OracleNavigator(config.oracle)
    from vinl.chain.navigators.learned import LearnedNavigator

    bare, shipped = str(name).removeprefix("vinl/"), list_policies()
    if bare not in shipped and not Path(name).exists():
        known = [ORACLE, *[policy for policy in shipped if read_card(find_policy(policy)).kind == "navigation"]]
        raise InputError(
            f"unknown navigator {str(name)!r}{closest(bare, known)}; known: {', '.join(known)}; or give a policy folder"
        )
    period = config.navigation_period * CONTROL_DT
    learned = LearnedNavigator(load_policy(name, device), period)
    if not recovery:
        return learned
    from vinl.chain.navigators.recovery import RecoveringNavigator

    return RecoveringNavigator(learned, period)
