"""AlienGo: names, default pose, gains. Masses, limits and shapes stand in ``assets/aliengo/aliengo.xml``."""

from __future__ import annotations

from typing import Any

import numpy as np

from vinl.robot.rotation import matrix_of

LEGS = ("FL", "FR", "RL", "RR")
"""Legs in the order of every joint array: front left, front right, rear left, rear right."""

JOINTS = tuple(f"{leg}_{part}" for leg in LEGS for part in ("hip", "thigh", "calf"))
"""The 12 joints in the order of every joint array."""

DEFAULT_POSE = np.array([0.1, 0.8, -1.5, -0.1, 0.8, -1.5, 0.1, 1.0, -1.5, -0.1, 1.0, -1.5])
"""Joint angles [rad] of the standing pose that actions are measured from [ViNL config, vinl_default]."""

KP = 40.0
"""Position gain of every joint [N m / rad] [ViNL config]."""

KD = 2.0
"""Velocity gain of every joint [N m s / rad] [ViNL config]."""

ACTION_SCALE = 0.25
"""Joint target = default pose + scale * action [rad] [ViNL config]."""

GRAVITY = 9.81
"""[m/s2]."""

MASS = 24.937
"""Of the whole robot [kg] [Unitree aliengo.urdf]."""

TORQUE_LIMIT = np.array([35.278, 35.278, 44.4] * 4)
"""Largest torque of every joint [N m] [Unitree aliengo.urdf]."""

JOINT_SPEED_LIMIT = np.array([20.0, 20.0, 15.89] * 4)
"""Fastest speed of every joint [rad/s] [Unitree aliengo.urdf]. The simulated motors of MuJoCo C do not know it."""

PHYSICS_DT = 0.005
"""Physics step [s] [ViNL config]."""

SUBSTEPS = 4
"""Physics steps for each action: the policy runs at 50 Hz [paper, III-A]."""

CONTROL_DT = PHYSICS_DT * SUBSTEPS
"""Time between actions [s]."""

STANDING_HEIGHT = 0.38
"""Height of the trunk over the floor in the default pose [m] [ViNL config, init_state]."""

FOOT_RADIUS = 0.0265
"""Radius of the foot sphere [m] [Unitree const.xacro]."""

FOOT_GEOMS = tuple(f"{leg}_foot" for leg in LEGS)
"""Geoms of the feet, one a leg, in both collision sets."""

SHANK_SPHERES = tuple(f"{leg}_shank{k}" for leg in LEGS for k in range(3))
"""Sphere set: three spheres along each shank, knee first."""

TRUNK_SPHERES = tuple(f"trunk{k}" for k in range(6))
"""Sphere set: the trunk."""

LENGTH, WIDTH = 0.70, 0.38
"""Rectangle that the standing robot covers on the floor [m]: trunk 0.65 and feet 0.313 apart [measured on the
maker's meshes], with some room for the swing of the legs."""


def home_qpos(x: float = 0.0, y: float = 0.0, z: float = STANDING_HEIGHT, yaw: float = 0.0) -> np.ndarray:
    """Generalised position (19,) of the standing robot: trunk position [m], quaternion w x y z, joint angles [rad]."""
    return np.concatenate([[x, y, z, np.cos(yaw / 2), 0.0, 0.0, np.sin(yaw / 2)], DEFAULT_POSE])


_FRONT = np.array([1.0 if leg[0] == "F" else -1.0 for leg in LEGS])
_LEFT = np.array([1.0 if leg[1] == "L" else -1.0 for leg in LEGS])
HIPS = np.stack([0.2407 * _FRONT, 0.051 * _LEFT, 0.0 * _LEFT], 1)
"""(4, 3) hip joints in the trunk's frame [m] [aliengo.xml]."""

THIGH_ASIDE = 0.0868 * _LEFT
"""(4,) how far the thigh joint lies aside of the hip joint [m] [aliengo.xml]."""

LINK = 0.25
"""Length of a thigh and of a shank [m] [aliengo.xml]."""


def foot_positions(xp: Any, qpos: Any) -> Any:
    """Middles of the feet (n, 4, 3) in the world [m], in the order of ``LEGS``, of robots at ``qpos`` (n, 19): trunk
    position [m], unit quaternion w x y z, joint angles [rad]; for numpy and jax.numpy (``xp``)."""
    return _leg_points(xp, qpos, 1.0)


def knee_positions(xp: Any, qpos: Any) -> Any:
    """(n, 4, 3) the knees in the world [m]; arguments as for ``foot_positions``."""
    return _leg_points(xp, qpos, 0.0)


def _leg_points(xp: Any, qpos: Any, down: float) -> Any:
    """Points along the shanks, from the knee (0) to the foot (1)."""
    hip, thigh, calf = (qpos[:, 7 + k :: 3] for k in range(3))
    below = -LINK * (xp.cos(thigh) + down * xp.cos(thigh + calf))
    ahead = -LINK * (xp.sin(thigh) + down * xp.sin(thigh + calf))
    aside = xp.asarray(THIGH_ASIDE, dtype=qpos.dtype)
    c, s = xp.cos(hip), xp.sin(hip)
    in_trunk = xp.stack([ahead, c * aside - s * below, s * aside + c * below], -1) + xp.asarray(HIPS, dtype=qpos.dtype)
    turned = (matrix_of(xp, qpos[:, 3:7])[:, None] * in_trunk[:, :, None, :]).sum(-1)
    return turned + qpos[:, None, :3]
