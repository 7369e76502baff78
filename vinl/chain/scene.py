"""The world of an episode in MuJoCo C: the robot, the ground, and boxes for walls, furniture and blocks."""

from __future__ import annotations

import mujoco
import numpy as np

from vinl.robot.aliengo import FOOT_GEOMS, KD, KP
from vinl.robot.model import robot_spec
from vinl.world.boxes import Boxes
from vinl.world.grid import HeightField

WALLS, BLOCKS, GROUND = "walls", "blocks", "ground"
"""Names of the static bodies of walls (with furniture) and blocks, and of the ground's geom."""

TOUCH_SENSORS = ("touch_blocks", "touch_walls", "touch_ground", "touch_self")
"""One number each, the contacts of the whole robot with blocks and walls, of the trunk with the ground, and of the
robot with itself."""

FORCE_SENSORS = tuple(f"force_{foot}" for foot in FOOT_GEOMS)
"""Three numbers each, the net contact force on a foot in the world frame [N], up to its sign."""

_FOUND = 1 << int(mujoco.mjtConDataField.mjCONDATA_FOUND)
_FORCE = 1 << int(mujoco.mjtConDataField.mjCONDATA_FORCE)
_ANY, _NET_FORCE = 0, 3
_SOLID = {"contype": 1, "conaffinity": 0}
"""See ``robot.model`` for the robot's own."""


def build_scene(
    walls: Boxes, blocks: Boxes, ground: HeightField | None = None, kp: float = KP, kd: float = KD
) -> mujoco.MjModel:
    """Compile the world; arguments as for ``scene_spec``."""
    return scene_spec(walls, blocks, ground, kp, kd).compile()


def scene_spec(
    walls: Boxes, blocks: Boxes, ground: HeightField | None = None, kp: float = KP, kd: float = KD
) -> mujoco.MjSpec:
    """The world before it is compiled.

    All walls are geoms of one static body and all blocks of another, so that MuJoCo's bounding volume trees find the
    few boxes near the robot: a step costs 30 us with 260 boxes, half of what one body a box costs. Contact sensors
    tell whether anything was touched for 1 us a step; only then are the contacts looked at in Python.

    Args:
        ground: a height field to stand on; a plane at z = 0 by default.
        kp: position gain of the joints [N m / rad].
        kd: velocity gain of the joints [N m s / rad].
    """
    spec = robot_spec("primitives", kp=kp, kd=kd)
    _add_ground(spec, ground)
    for name, boxes in ((WALLS, walls), (BLOCKS, blocks)):
        body = spec.worldbody.add_body(name=name)
        for x, y, yaw, length, width, bottom, top in boxes.rows:
            body.add_geom(
                type=mujoco.mjtGeom.mjGEOM_BOX,
                pos=[x, y, (bottom + top) / 2],
                size=[length / 2, width / 2, (top - bottom) / 2],
                quat=[np.cos(yaw / 2), 0.0, 0.0, np.sin(yaw / 2)],
                **_SOLID,
            )
    kind = mujoco.mjtObj
    for sensor, first, name, second, other in (
        (TOUCH_SENSORS[0], kind.mjOBJ_XBODY, "trunk", kind.mjOBJ_BODY, BLOCKS),
        (TOUCH_SENSORS[1], kind.mjOBJ_XBODY, "trunk", kind.mjOBJ_BODY, WALLS),
        (TOUCH_SENSORS[2], kind.mjOBJ_GEOM, "trunk", kind.mjOBJ_GEOM, GROUND),
        (TOUCH_SENSORS[3], kind.mjOBJ_XBODY, "trunk", kind.mjOBJ_XBODY, "trunk"),
    ):
        _add_contact_sensor(spec, sensor, first, name, second, other, _FOUND, _ANY)
    for sensor, foot in zip(FORCE_SENSORS, FOOT_GEOMS, strict=True):
        _add_contact_sensor(spec, sensor, kind.mjOBJ_GEOM, foot, kind.mjOBJ_UNKNOWN, "", _FORCE, _NET_FORCE)
    return spec


def _add_contact_sensor(
    spec: mujoco.MjSpec, name: str, first: mujoco.mjtObj, a: str, second: mujoco.mjtObj, b: str, data: int, reduce: int
) -> None:
    spec.add_sensor(
        name=name,
        type=mujoco.mjtSensor.mjSENS_CONTACT,
        objtype=first,
        objname=a,
        reftype=second,
        refname=b,
        intprm=[data, reduce, 1],
    )


def _add_ground(spec: mujoco.MjSpec, ground: HeightField | None) -> None:
    if ground is None:
        spec.worldbody.add_geom(name=GROUND, type=mujoco.mjtGeom.mjGEOM_PLANE, size=[0, 0, 1], **_SOLID)
        return
    rows, columns = ground.frame.shape
    low, high = float(ground.heights.min()), float(ground.heights.max())
    span = max(high - low, 1e-3)
    half = np.array([columns - 1, rows - 1]) * ground.frame.resolution / 2
    spec.add_hfield(
        name=GROUND,
        nrow=rows,
        ncol=columns,
        size=[*half, span, 0.1],
        userdata=((ground.heights - low) / span).astype(np.float32).ravel(),
    )
    # MuJoCo takes a height field for prisms. Where a foot sinks in by a centimetre, its newer collision code pushes it
    # sideways, off the inner wall of the next prism (60 % of the normals on a level field lie flat, and the robot
    # trips); the older code gives the same walk as on a plane.
    spec.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_NATIVECCD
    spec.worldbody.add_geom(
        name=GROUND,
        type=mujoco.mjtGeom.mjGEOM_HFIELD,
        hfieldname=GROUND,
        **_SOLID,
        pos=[ground.frame.x0 + half[0], ground.frame.y0 + half[1], low],
    )
