"""AlienGo: names, default pose, gains. Masses, limits and shapes stand in ``assets/aliengo/aliengo.xml``."""

from __future__ import annotations

import numpy as np

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
