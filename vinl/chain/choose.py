"""The locomotion policy that walks: the one that is named, or the best shipped one; and whether it fits the robot."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from vinl.config.errors import InputError
from vinl.config.fields import closest
from vinl.gait.observation import SENSED_TABLE
from vinl.policies.card import find_detour, find_gait, locomotion_table
from vinl.policies.io import list_policies, load_policy
from vinl.policies.policy import Policy
from vinl.robot.cameras import LOCOMOTION_CAMERA, NAVIGATION_CAMERA
from vinl.robot.observation import PROPRIOCEPTION_SIZE

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
        InputError: it is of another kind, its table is none that the robot has, or its commands are bent as they
            cannot be.
    """
    card = policy.card
    if card.kind != "locomotion":
        raise InputError(f"{card.name} is a {card.kind} policy; a locomotor (--loco, --policy) is a locomotion policy")
    gait = find_gait(card) is not None
    plain, scanned = (locomotion_table(scan, gait).size for scan in (False, True))
    if card.observation_size not in (SENSED_TABLE.size, plain, scanned):
        raise InputError(
            f"policy {card.name} observes {card.observation_size} numbers; the robot has {plain}, or {scanned} "
            "with the height scan"
        )
    if find_detour(card) is not None and card.observation_size == PROPRIOCEPTION_SIZE:
        raise InputError(f"policy {card.name}: commands are bent only for one that observes the height scan")
