"""Coloured meshes of homes for pictures: walls cut low, so that a camera above them sees inside."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np
from jaxtyping import Float, Int

from vinl.robot.model import robot_spec
from vinl.world.boxes import Blocks, Boxes
from vinl.world.floorplan import FloorPlan
from vinl.world.grid import GridFrame
from vinl.world.mesh import TRIANGLES_PER_BOX, box_mesh, join_meshes

Colour = tuple[float, float, float]
"""Red, green, blue, 0 to 1."""

WALL, FLOOR, BLOCK, GOAL = (0.90, 0.89, 0.86), (0.80, 0.74, 0.66), (0.86, 0.40, 0.20), (0.15, 0.62, 0.35)
FURNITURE = (
    (0.56, 0.62, 0.68),
    (0.69, 0.58, 0.47),
    (0.52, 0.60, 0.54),
    (0.66, 0.55, 0.60),
    (0.74, 0.68, 0.55),
    (0.48, 0.53, 0.62),
)
"""Muted, so that robot and blocks stand out."""


@dataclass(frozen=True, eq=False)
class Scene:
    """A world that does not move: vertices [m], faces and their colours, 0 to 1, and a floor z = 0 that covers a grid
    and is checked with squares of a side [m]."""

    vertices: Float[np.ndarray, "v 3"]
    faces: Int[np.ndarray, "f 3"]
    colours: Float[np.ndarray, "f 3"]
    floor: GridFrame
    floor_colour: Colour = FLOOR
    checker: float = 0.5


def plain_scene(
    boxes: Boxes, colours: Sequence[Colour], frame: GridFrame, floor: Colour = FLOOR, checker: float = 0.5
) -> Scene:
    """Boxes, each of a colour, on a floor that covers a grid and is checked with squares of a side [m]."""
    # A mesh needs a face; the one below the floor is never seen.
    hidden = np.array([[0, 0, -2], [0.1, 0, -2], [0, 0.1, -2]]), np.array([[0, 1, 2]])
    vertices, faces = join_meshes(box_mesh(boxes), hidden)
    painted = np.repeat(np.array([*colours, floor]), [*[TRIANGLES_PER_BOX] * len(boxes), 1], axis=0)
    return Scene(vertices, faces, painted.astype(np.float32), frame, floor, checker)


def plan_scene(
    plan: FloorPlan,
    blocks: Blocks | None = None,
    goal: tuple[float, float] | None = None,
    wall_height: float = 1.0,
    furniture_height: float = 1.0,
) -> Scene:
    """A home as a doll's house: no ceiling, walls and furniture cut off at these heights [m]. A thin green square on
    the floor marks the goal [m]."""
    parts, colours = [], []
    for boxes, height, palette in ((plan.walls, wall_height, (WALL,)), (plan.furniture, furniture_height, FURNITURE)):
        cut = boxes.rows[boxes.rows[:, 5] < height - 0.02].copy()
        # Boxes that overlap must not share a plane: their colours would mix in a speckle.
        shift = 0.0007 * (np.arange(len(cut)) % 7)
        cut[:, 6] = np.maximum(np.minimum(cut[:, 6], height) - shift, cut[:, 5] + 0.001)
        cut[:, 3:5] = np.maximum(cut[:, 3:5] - shift[:, None], 0.001)
        parts.append(cut)
        colours += [palette[k % len(palette)] for k in range(len(cut))]
    if blocks is not None:
        parts.append(blocks.boxes().rows)
        colours += [BLOCK] * len(blocks)
    if goal is not None:
        parts.append(np.array([[goal[0], goal[1], np.pi / 4, 0.4, 0.4, 0.0, 0.01]]))
        colours.append(GOAL)
    return plain_scene(Boxes(np.concatenate(parts)), colours, plan.frame)


# pyright: reportAttributeAccessIssue=false, reportOptionalMemberAccess=false
# (MuJoCo carries no types for its compiled part)


@dataclass(frozen=True, eq=False)
class BodyMesh:
    """A coloured mesh that moves with the body of a name, in whose frame its vertices are [m]; faces are
    counter-clockwise from outside."""

    vertices: Float[np.ndarray, "v 3"]
    faces: Int[np.ndarray, "f 3"]
    colour: tuple[float, float, float]
    body: str


class RobotShape:
    """The robot's visual meshes, one for each visual geom, and its kinematics; ``names`` are its bodies, in the order
    of the frames that ``place`` returns."""

    def __init__(self) -> None:
        self._model = robot_spec("primitives", visual=True).compile()
        self._data = mujoco.MjData(self._model)
        self.names = tuple(self._model.body(k).name for k in range(1, self._model.nbody))
        self.bodies = robot_bodies(self._model)

    def place(self, qpos: Float[np.ndarray, " 19"]) -> tuple[Float[np.ndarray, "b 3"], Float[np.ndarray, "b 3 3"]]:
        """Positions (13, 3) [m] and rotations (13, 3, 3), body to world, of the bodies in the order of ``names``."""
        self._data.qpos[:] = qpos
        mujoco.mj_kinematics(self._model, self._data)
        return self._data.xpos[1:].copy(), self._data.xmat[1:].reshape(-1, 3, 3).copy()


def robot_bodies(model: mujoco.MjModel) -> list[BodyMesh]:
    """The visual meshes of a compiled robot, each in the frame of the body that carries it."""
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
