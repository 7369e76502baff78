"""What the locomotors of a unit observe: the numbers that the card names, and depth if they have a camera."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from vinl.chain.depth_cameras import DepthCameras, open_depth_cameras
from vinl.chain.ground_map import GroundMap
from vinl.chain.real_cameras import CameraErrors, RealCameras
from vinl.config.errors import InputError
from vinl.policies.card import find_detour, reads_ground
from vinl.policies.policy import Policy
from vinl.robot.observation import SCAN_SIZE, observe
from vinl.world.blocks import Blocks
from vinl.world.floorplan import FloorPlan


class LocomotionController:
    """Asks a locomotor for the next action of all robots of a unit.

    A policy of 48 numbers gets only proprioception, one of 235 the height scan too; one with a camera gets
    depth.

    Args:
        locomotor: the policy.
        scan: reads the height scan that the policy observes, and bends its commands if it was trained so; None: it
            observes none.
        cameras: renders depth; needed only by a policy with a camera.
    """

    def __init__(self, locomotor: Policy, scan: GroundMap | None, cameras: DepthCameras | RealCameras | None) -> None:
        self._locomotor, self._scan, self._cameras = locomotor, scan, cameras
        self._size = locomotor.card.observation_size

    def act(
        self,
        qpos: Float[np.ndarray, "n 19"],
        qvel: Float[np.ndarray, "n 18"],
        command: Float[np.ndarray, "n 3"],
        actions: Float[np.ndarray, "n 12"],
        rows: Sequence[int] | None = None,
    ) -> Float[np.ndarray, "n 12"]:
        """The next actions. ``actions`` are the last ones, ``rows`` those still alive (``DepthCameras.look``)."""
        ground = np.zeros((len(qpos), SCAN_SIZE))
        if self._scan is not None:
            ground, command = self._scan.read(qpos), self._scan.bend(qpos, command)
        observation = observe(np, qpos, qvel, command, actions, ground)[:, : self._size]
        if self._cameras is None:
            answer = self._locomotor.act(observation)
        else:
            answer = self._locomotor.act(observation, self._cameras.look(qpos, rows))
        return check_actions(answer, len(qpos), self._locomotor)


def open_controller(
    locomotor: Policy,
    plan: FloorPlan,
    blocks: Sequence[Blocks],
    ceiling: float | None = None,
    errors: CameraErrors | None = None,
    pitch: float = 0.0,
) -> LocomotionController:
    """The controller of robots in a floor plan, each with its own clutter, see ``open_depth_cameras``.

    ``errors`` are those of their cameras, which look down by ``pitch`` [rad] more than they should.
    """
    scan = GroundMap(plan, blocks, find_detour(locomotor.card)) if reads_ground(locomotor.card) else None
    cameras = None if locomotor.camera is None else open_depth_cameras(plan, blocks, locomotor.camera, ceiling, pitch)
    return LocomotionController(
        locomotor, scan, cameras if cameras is None or errors is None else errors.put_on(cameras)
    )


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
