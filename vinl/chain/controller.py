"""What the locomotors of a unit observe: the numbers that the card names, and depth if they have a camera."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from vinl.chain.depth_cameras import Eyes, open_eyes
from vinl.chain.ground_map import GroundScan
from vinl.chain.real_cameras import CameraErrors, RealCameras
from vinl.config.errors import InputError
from vinl.policies.card import find_detour, reads_ground
from vinl.policies.policy import Policy
from vinl.robot.observation import SCAN_SIZE, observe
from vinl.world.blocks import Blocks
from vinl.world.floorplan import FloorPlan


class Senses:
    """Asks a locomotor for the next action of all robots of a unit.

    A policy of 48 numbers gets only proprioception, one of 235 the height scan too; one with a camera gets
    depth.

    Args:
        locomotor: the policy.
        scan: reads the height scan that the policy observes, and bends its commands if it was trained so; None: it
            observes none.
        eyes: renders depth; needed only by a policy with a camera.
    """

    def __init__(self, locomotor: Policy, scan: GroundScan | None, eyes: Eyes | RealCameras | None) -> None:
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
        ground = np.zeros((len(qpos), SCAN_SIZE))
        if self._scan is not None:
            ground, command = self._scan.read(qpos), self._scan.bend(qpos, command)
        observation = observe(np, qpos, qvel, command, actions, ground)[:, : self._size]
        if self._eyes is None:
            answer = self._locomotor.act(observation)
        else:
            answer = self._locomotor.act(observation, self._eyes.look(qpos, rows))
        return check_actions(answer, len(qpos), self._locomotor)


def give_senses(
    locomotor: Policy,
    plan: FloorPlan,
    blocks: Sequence[Blocks],
    ceiling: float | None = None,
    errors: CameraErrors | None = None,
) -> Senses:
    """The senses of robots in a floor plan, each with its own clutter, see ``open_eyes``; ``errors`` are those of their
    cameras."""
    scan = GroundScan(plan, blocks, find_detour(locomotor.card)) if reads_ground(locomotor.card) else None
    eyes = None if locomotor.camera is None else open_eyes(plan, blocks, locomotor.camera, ceiling)
    return Senses(locomotor, scan, eyes if eyes is None or errors is None else errors.put_on(eyes))


def check_actions(actions: np.ndarray, n: int, locomotor: Policy) -> np.ndarray:
    """What a locomotor answered, if it makes sense.

    Raises:
        InputError: another shape than (n, 12), or numbers that are not finite.
    """
    if np.shape(actions) != (n, 12):
        raise InputError(f"locomotor {locomotor.card.name} must return ({n}, 12) actions, got {np.shape(actions)}")
    if not np.isfinite(actions).all():
        raise InputError(f"locomotor {locomotor.card.name} returned actions that are not finite (NaN or infinite)")
    return actions
