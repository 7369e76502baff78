"""The AlienGo as a MuJoCo spec: one MJCF, two collision sets, two solver settings."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import mujoco

from vinl.config.paths import assets_dir
from vinl.robot.aliengo import KD, KP, PHYSICS_DT

CollisionSet = Literal["spheres", "primitives"]
_GROUP = {"spheres": 3, "primitives": 4}
_VISUAL_GROUP = 2
_FOOT_GROUP = 1
_CONTYPE, _CONAFFINITY = 2, 3
"""Of geoms that touch each other and the world, whose geoms have ``contype`` 1 and ``conaffinity`` 0."""


def mjcf_path() -> Path:
    """The robot's MJCF file."""
    return assets_dir() / "aliengo" / "aliengo.xml"


def robot_spec(collision: CollisionSet, visual: bool = False, kp: float = KP, kd: float = KD) -> mujoco.MjSpec:
    """The robot in an empty world; the caller adds the ground and compiles. ``kp`` and ``kd`` are the gains of every
    joint [N m / rad, N m s / rad]; ``visual`` keeps the visual meshes, which physics does not need.

    ``"spheres"`` are for MJX on height fields: one Newton iteration with Euler (fast, stable only with eulerdamp off);
    legs touch nothing of the robot. ``"primitives"`` are for MuJoCo C: converged elliptic contacts; legs touch each
    other and the trunk, but a link never the one that it is jointed to. The feet are in both.
    """
    spec = mujoco.MjSpec.from_file(str(mjcf_path()))
    unwanted = {group for name, group in _GROUP.items() if name != collision}
    if not visual:
        unwanted.add(_VISUAL_GROUP)
    for geom in list(spec.geoms):
        if geom.group in unwanted:
            spec.delete(geom)
    if not visual:
        for mesh in list(spec.meshes):
            spec.delete(mesh)
    for actuator in spec.actuators:
        actuator.gainprm[0] = kp
        actuator.biasprm[1:3] = (-kp, -kd)
    option = spec.option
    option.timestep = PHYSICS_DT
    if collision == "spheres":
        option.integrator = mujoco.mjtIntegrator.mjINT_EULER
        option.disableflags |= mujoco.mjtDisableBit.mjDSBL_EULERDAMP
        option.iterations, option.ls_iterations = 1, 5
    else:
        option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
        option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
        option.impratio = 10
        option.iterations, option.ls_iterations = 50, 50
        for geom in spec.geoms:
            if geom.group in (_FOOT_GROUP, _GROUP[collision]):
                geom.contype, geom.conaffinity = _CONTYPE, _CONAFFINITY
    return spec
