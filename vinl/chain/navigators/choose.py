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


def load_navigator(name: str | Path, config: EvaluationConfig, device: str = "cpu") -> Navigator:
    """The oracle, or a trained navigator.

    Args:
        name: ``"oracle"``, a shipped navigation policy's name, a policy folder or the folder of a training run.
        config: how the oracle walks.
        device: of a trained navigator.

    Raises:
        InputError: there is none of that name, or it is a policy of another kind.
    """
    if name == ORACLE:
        from vinl.chain.navigators.oracle import OracleNavigator

        return OracleNavigator(config.oracle)
    from vinl.chain.navigators.learned import LearnedNavigator

    bare, shipped = str(name).removeprefix("vinl/"), list_policies()
    if bare not in shipped and not Path(name).exists():
        known = [ORACLE, *[policy for policy in shipped if read_card(find_policy(policy)).kind == "navigation"]]
        raise InputError(
            f"unknown navigator {str(name)!r}{closest(bare, known)}; known: {', '.join(known)}; or give a policy folder"
        )
    return LearnedNavigator(load_policy(name, device), config.navigation_period * CONTROL_DT, config.recovery)
