"""What the locomotors of a unit observe: the numbers that the card names, and depth if they have a camera."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from vinl.config.errors import InputError
from vinl.evaluation.eyes import Eyes, open_eyes
from vinl.evaluation.ground_scan import GroundScan
from vinl.policies.policy import Policy
from vinl.robot.observation import OBSERVATION_SIZE, PROPRIOCEPTION_SIZE, SCAN_SIZE, observe
from vinl.world.blocks import Blocks
from vinl.world.floorplan import FloorPlan


class Senses:
    """Asks a locomotor for the next action of all robots of a unit.

    A policy of 235 numbers gets the height scan, one of 48 only proprioception; one with a camera gets depth too.

    Args:
        locomotor: the policy.
        scan: reads the height scan; needed only by a policy that observes it.
        eyes: renders depth; needed only by a policy with a camera.
    """

    def __init__(self, locomotor: Policy, scan: GroundScan | None, eyes: Eyes | None) -> None:
        self._locomotor, self._scan, self._eyes = locomotor, scan, eyes
        self._size = locomotor.card.observation_size

    def act(
        self,
        qpos: Float[np.ndarray, "n 19"],
        qvel: Float[np.ndarray, "n 18"],
        command: Float[np.ndarray, "n 3"],
        actions: Float[np.ndarray, "n 12"],
        rows: Sequence[int] | None = None,
    ) -> Float[np.ndarray, "n 12"]:
        """The next actions. ``rows`` are the robots that still live, see ``Eyes.look``; ``actions`` the last ones."""
        ground = np.zeros((len(qpos), SCAN_SIZE)) if self._scan is None else self._scan.read(qpos)
        observation = observe(np, qpos, qvel, command, actions, ground)[:, : self._size]
        if self._eyes is None:
            return self._locomotor.act(observation)
        return self._locomotor.act(observation, self._eyes.look(qpos, rows))


def give_senses(locomotor: Policy, plan: FloorPlan, blocks: Sequence[Blocks], ceiling: float | None = None) -> Senses:
    """The senses of robots in a floor plan, each with its own clutter, see ``open_eyes``."""
    scan = GroundScan(plan, blocks) if locomotor.card.observation_size > PROPRIOCEPTION_SIZE else None
    eyes = None if locomotor.camera is None else open_eyes(plan, blocks, locomotor.camera, ceiling)
    return Senses(locomotor, scan, eyes)


def check_senses(policy: Policy) -> None:
    """Refuse a policy that is no locomotor, or observes what there is not.

    Raises:
        InputError: it is of another kind, or its table is neither the whole one nor proprioception alone.
    """
    card = policy.card
    if card.kind != "locomotion":
        raise InputError(f"{card.name} is a {card.kind} policy; a locomotor (--loco, --policy) is a locomotion policy")
    if card.observation_size not in (PROPRIOCEPTION_SIZE, OBSERVATION_SIZE):
        raise InputError(
            f"policy {card.name} observes {card.observation_size} numbers; the robot has {PROPRIOCEPTION_SIZE}, or "
            f"{OBSERVATION_SIZE} with the height scan"
        )
