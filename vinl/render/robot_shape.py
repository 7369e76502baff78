"""The robot as pictures show it: a triangle mesh for each body, and where the bodies are for given joint angles."""

# pyright: reportAttributeAccessIssue=false, reportOptionalMemberAccess=false
# (MuJoCo carries no types for its compiled part)

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np
from jaxtyping import Float, Int

from vinl.robot.model import robot_spec


@dataclass(frozen=True, eq=False)
class BodyMesh:
    """A coloured mesh that moves with a body.

    Attributes:
        vertices: (v, 3) in the body's frame [m].
        faces: (f, 3), counter-clockwise from outside.
        colour: red, green, blue, 0 to 1.
        body: name of the body.
    """

    vertices: Float[np.ndarray, "v 3"]
    faces: Int[np.ndarray, "f 3"]
    colour: tuple[float, float, float]
    body: str


class RobotShape:
    """The robot's visual meshes and its kinematics.

    Attributes:
        bodies: one mesh for each visual geom.
        names: the robot's bodies, in the order of the frames that ``place`` returns.
    """

    def __init__(self) -> None:
        self._model = robot_spec("primitives", visual=True).compile()
        self._data = mujoco.MjData(self._model)
        self.names = tuple(self._model.body(k).name for k in range(1, self._model.nbody))
        self.bodies = robot_bodies(self._model)

    def place(self, qpos: Float[np.ndarray, " 19"]) -> tuple[Float[np.ndarray, "b 3"], Float[np.ndarray, "b 3 3"]]:
        """Where the bodies are.

        Args:
            qpos: trunk position [m] and quaternion w x y z, joint angles [rad].

        Returns:
            positions (13, 3) [m] and rotations (13, 3, 3), body to world, in the order of ``names``.
        """
        self._data.qpos[:] = qpos
        mujoco.mj_kinematics(self._model, self._data)
        return self._data.xpos[1:].copy(), self._data.xmat[1:].reshape(-1, 3, 3).copy()


def robot_bodies(model: mujoco.MjModel | None = None) -> list[BodyMesh]:
    """The visual meshes of the robot, each in the frame of the body that carries it.

    Args:
        model: a compiled robot with visual meshes; a fresh one by default.
    """
    if model is None:
        model = robot_spec("primitives", visual=True).compile()
    found = []
    for geom in np.flatnonzero(model.geom_type == mujoco.mjtGeom.mjGEOM_MESH):
        mesh = model.geom_dataid[geom]
        start, count = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
        first, faces = model.mesh_faceadr[mesh], model.mesh_facenum[mesh]
        turn = np.empty(9)
        mujoco.mju_quat2Mat(turn, model.geom_quat[geom])
        vertices = model.mesh_vert[start : start + count] @ turn.reshape(3, 3).T + model.geom_pos[geom]
        red, green, blue = (float(value) for value in model.geom_rgba[geom, :3])
        found.append(
            BodyMesh(
                vertices.astype(np.float32),
                model.mesh_face[first : first + faces].astype(np.int32),
                (red, green, blue),
                model.body(model.geom_bodyid[geom]).name,
            )
        )
    return found
