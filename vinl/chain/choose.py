"""Who walks: the locomotion policy and the navigator of a name, or the shipped ones; and whether they fit the robot."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from vinl.chain.config import EvaluationConfig
from vinl.chain.navigators.base import ORACLE, Navigator
from vinl.chain.navigators.learned import LearnedNavigator
from vinl.chain.navigators.oracle import OracleNavigator
from vinl.chain.navigators.recovery import RecoveringNavigator
from vinl.config.errors import InputError
from vinl.config.loader import closest
from vinl.gait.observation import SENSED_TABLE
from vinl.policies.card import find_gait, locomotion_table, read_card
from vinl.policies.io import find_policy, list_policies, load_policy
from vinl.policies.policy import Policy
from vinl.robot.aliengo import CONTROL_DT
from vinl.robot.cameras import LOCOMOTION_CAMERA, NAVIGATION_CAMERA

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
    if not all(hasattr(policy, name) for name in ("reset", "act", "card")):
        raise InputError(
            f"a locomotor is a name, a folder, or has reset, act and card; got {type(policy).__name__} (functions: "
            "vinl.as_locomotor)"
        )
    check_locomotion_policy(policy)
    return policy


MOUNT_REACH = 0.25
"""So far from its place on the trunk a camera may be mounted [m]: anywhere at the robot's head."""


def check_cameras(*seeing: Any) -> None:
    """Refuse a policy or navigator that sees through a camera that the robot does not carry.

    Raises:
        InputError: the camera's name is that of neither camera, or it is mounted where neither could be.
    """
    for one in seeing:
        camera = one.camera
        if camera is None:
            continue
        name = one.card.name if hasattr(one, "card") else type(one).__name__
        known = {mount.name: mount for mount in (LOCOMOTION_CAMERA, NAVIGATION_CAMERA)}
        if camera.name not in known:
            raise InputError(
                f"{name} sees through a camera {camera.name!r} that the robot lacks"
                f"{closest(camera.name, known)}; it carries: {', '.join(known)}"
            )
        away = float(np.linalg.norm(np.subtract(camera.position, known[camera.name].position)))
        if away > MOUNT_REACH:
            raise InputError(
                f"{name} sees through a camera at {tuple(camera.position)} m on the trunk; the robot's {camera.name} "
                f"camera is at {known[camera.name].position}, and can be moved by {MOUNT_REACH} m"
            )


def check_locomotion_policy(policy: Policy) -> None:
    """Refuse a policy that is no locomotor, or observes what there is not.

    Raises:
        InputError: it is of another kind, or its table is none that the robot has.
    """
    card = policy.card
    if card.kind != "locomotion":
        raise InputError(f"{card.name} is a {card.kind} policy; give a locomotion policy (--loco, --policy)")
    wanted = locomotion_table(find_gait(card) is not None).size
    if card.observation_size not in (SENSED_TABLE.size, wanted):
        raise InputError(
            f"policy {card.name} observes {card.observation_size} numbers; the robot has {wanted}, or "
            f"{SENSED_TABLE.size} without the velocity of its trunk"
        )


NAVIGATOR = "nav"
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
    return NAVIGATOR if NAVIGATOR in list_policies() else ORACLE


def load_navigator(
    name: str | Path, config: EvaluationConfig, device: str = "cpu", recovery: bool = False
) -> Navigator:
    """The oracle, or a trained navigator.

    Args:
        name: ``"oracle"``, a shipped navigation policy's name, a policy folder or the folder of a training run.
        recovery: free its robots where they are stuck (``RecoveringNavigator``); the oracle never has that.

    Raises:
        InputError: there is none of that name, or it is a policy of another kind.
    """
    if name == ORACLE:
        if recovery:
            raise InputError("recovery frees robots of a learned navigator; the oracle has none")
        return OracleNavigator(config.oracle)
    bare, shipped = str(name).removeprefix("vinl/"), list_policies()
    if bare not in shipped and not Path(name).exists():
        known = [ORACLE, *[policy for policy in shipped if read_card(find_policy(policy)).kind == "navigation"]]
        raise InputError(
            f"unknown navigator {str(name)!r}{closest(bare, known)}; known: {', '.join(known)}; or give a policy folder"
        )
    period = config.navigation_period * CONTROL_DT
    learned = LearnedNavigator(load_policy(name, device), period)
    return RecoveringNavigator(learned, period) if recovery else learned
