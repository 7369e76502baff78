"""One control step of a locomotion policy: observe, act, joint targets."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from jaxtyping import Bool, Float

from vinl.chain.depth_cameras import CameraErrors, DepthCameras, RealCameras, open_depth_cameras
from vinl.chain.ground_reader import GaitReader, map_plan
from vinl.config.errors import InputError
from vinl.gait.observation import SENSED_TABLE, insert_gait
from vinl.policies.card import PolicyCard, find_gait
from vinl.policies.policy import DatesImages, Policy
from vinl.robot.aliengo import DEFAULT_POSE
from vinl.robot.observation import PROPRIOCEPTION_SIZE, observe
from vinl.world.boxes import Blocks
from vinl.world.floorplan import FloorPlan

ACTION_LIMIT = 100.0
"""Actions are held to +- this [ViNL config]."""


class LocomotionController:
    """One control step of a locomotion policy for n robots: observe, act, joint targets. Remembers the last actions.

    A policy gets what its card lists: proprioception, with or without the velocity of the trunk, and the rows of a gait
    that is planned on the map; one with a camera gets depth.

    Args:
        cameras: renders depth; needed only by a policy with a camera.
        gait: plans the gait whose rows the policy observes; None: it observes none.

    Attributes:
        actions: (n, 12) the last ones; none before the first ``reset``.
    """

    def __init__(
        self, policy: Policy, cameras: DepthCameras | RealCameras | None, gait: GaitReader | None = None
    ) -> None:
        self.policy, self._cameras, self._gait = policy, cameras, gait
        sensed = policy.card.observation_size == SENSED_TABLE.size
        self._first = PROPRIOCEPTION_SIZE - SENSED_TABLE.size if sensed else 0
        self.actions = np.zeros((0, 12), np.float32)

    def reset(self, which: int | Bool[np.ndarray, " n"]) -> None:
        """So many robots begin, or those that a mask marks begin anew: the past is forgotten."""
        self.policy.reset(which)
        if isinstance(which, int):
            self.actions = np.zeros((which, 12), np.float32)
        else:
            self.actions[which] = 0
        if self._gait is not None:
            self._gait.reset(np.ones(which, bool) if isinstance(which, int) else which)

    def footholds(self) -> dict[str, Float[np.ndarray, "n 4 3"]]:
        """Where the feet come down next by the plan of the last step, as ``planned``, in the heading frames that the
        robots had then [m]; nothing without a gait or before the first step."""
        gait = None if self._gait is None else self._gait.gait
        return {} if gait is None else {"planned": gait.target}

    def take_over(self, before: LocomotionController) -> None:
        """Go on with the same robots in another world: their last actions, and their gait."""
        self.actions = before.actions
        if self._gait is not None and before._gait is not None:
            self._gait.take_over(before._gait)

    def step(
        self,
        qpos: Float[np.ndarray, "n 19"],
        qvel: Float[np.ndarray, "n 18"],
        command: Float[np.ndarray, "n 3"],
        rows: Sequence[int] | None = None,
    ) -> Float[np.ndarray, "n 12"]:
        """Joint targets [rad] of the next control step.

        Args:
            qpos, qvel: state of every robot, as MuJoCo has it.
            command: forward [m/s], left [m/s], yaw rate [rad/s].
            rows: the robots still alive, see ``DepthCameras.look``; None: all.

        Raises:
            InputError: the policy's answer is none.
        """
        gait_rows = None
        if self._gait is not None:
            command, gait_rows = self._gait.read(qpos, qvel, command)
        observation = observe(np, qpos, qvel, command, self.actions)[:, self._first :]
        if gait_rows is not None:
            observation = insert_gait(np, observation, gait_rows)
        if self._cameras is None:
            answer = self.policy.act(observation)
        elif isinstance(self.policy, DatesImages) and self.policy.dates_images:
            answer = self.policy.act(observation, self._cameras.look(qpos, rows), self._cameras.age)
        else:
            answer = self.policy.act(observation, self._cameras.look(qpos, rows))
        self.actions = check_actions(answer, len(qpos), self.policy)
        return joint_targets(self.actions, self.policy.card)


def open_controller(
    locomotor: Policy,
    plan: FloorPlan,
    blocks: Sequence[Blocks],
    ceiling: float | None = None,
    errors: CameraErrors | None = None,
) -> LocomotionController:
    """The controller of robots in a floor plan, each with its own clutter, see ``open_depth_cameras``; ``errors`` are
    those of their cameras."""
    cameras = None if locomotor.camera is None else open_depth_cameras(plan, blocks, locomotor.camera, ceiling)
    config = find_gait(locomotor.card)
    gait = None if config is None else GaitReader(config, map_plan(plan, blocks))
    return LocomotionController(
        locomotor, cameras if cameras is None or errors is None else errors.put_on(cameras), gait
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


def joint_targets(actions: Float[np.ndarray, "n 12"], card: PolicyCard) -> Float[np.ndarray, "n 12"]:
    """Actions of a policy as joint targets [rad]."""
    pose = np.asarray(card.action.get("default_pose", DEFAULT_POSE), dtype=np.float64)
    held = np.clip(actions.astype(np.float64), -ACTION_LIMIT, ACTION_LIMIT)
    return pose + float(card.action["scale"]) * held
