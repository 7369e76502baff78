"""Draws snapshots into a viser scene: home, clutter, robot, and what it is about."""

from __future__ import annotations

import threading
from typing import Any, Literal

import mujoco
import numpy as np
import viser
from jaxtyping import Bool, Float, Int, UInt8

from vinl.chain.robot import KINDS
from vinl.render.scene import BLOCK, FLOOR, RobotShape, plan_scene
from vinl.robot.cameras import Camera
from vinl.robot.rotation import yaw_of
from vinl.viewer.session import Snapshot
from vinl.viewer.world import World
from vinl.world.floorplan import FloorPlan
from vinl.world.mesh import box_mesh
from vinl.world.raster import split_rectangles

TILE = 0.5
"""Distance between the lines on the floor [m]."""


def list_runs(row: Bool[np.ndarray, " columns"]) -> list[tuple[int, int]]:
    """First and one past the last of each run of true cells."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], row, [False]]).astype(np.int8)))
    return [(int(a), int(b)) for a, b in edges.reshape(-1, 2)]


def inside_mesh(plan: FloorPlan) -> tuple[Float[np.ndarray, "v 3"], Int[np.ndarray, "f 3"]]:
    """The floor inside the building at z = 0, seen from above: vertices (v, 3) float32 [m] and faces (f, 3); some lie
    on one another."""
    rectangles, half = split_rectangles(plan.inside), plan.frame.resolution / 2
    low, high = plan.frame.xy(rectangles[:, :2]) - half, plan.frame.xy(rectangles[:, 2:]) - half
    corners = np.stack([low, np.stack([high[:, 0], low[:, 1]], 1), high, np.stack([low[:, 0], high[:, 1]], 1)], 1)
    vertices = np.concatenate([corners, np.zeros((len(corners), 4, 1))], 2).reshape(-1, 3)
    faces = np.arange(len(corners))[:, None, None] * 4 + np.array([[0, 1, 2], [0, 2, 3]])
    return vertices.astype(np.float32), faces.reshape(-1, 3)


def inside_lines(plan: FloorPlan) -> Float[np.ndarray, "n 2 3"]:
    """Lines ``TILE`` apart over the floor inside the building [m]: by them one sees the robot move."""
    frame, half, z = plan.frame, plan.frame.resolution / 2, 0.003
    x, y = frame.centres()
    every = round(TILE / frame.resolution)
    lines = []
    for i in range(0, len(y), every):
        lines += [[(x[a] - half, y[i], z), (x[b - 1] + half, y[i], z)] for a, b in list_runs(plan.inside[i])]
    for j in range(0, len(x), every):
        lines += [[(x[j], y[a] - half, z), (x[j], y[b - 1] + half, z)] for a, b in list_runs(plan.inside[:, j])]
    return np.array(lines, np.float32).reshape(-1, 2, 3)


LAYERS = {
    "path": "path",
    "contacts": "contacts",
    "forces": "forces on the feet",
    "footholds": "footholds",
    "occupied": "what the navigation policy remembers",
    "command": "commanded path",
    "cameras": "images at the cameras",
}
"""What can be shown or hidden, and how it is called."""

WALL_HEIGHT = 0.8
"""Walls and tall furniture are cut here, so that one sees inside [m]."""

CONTACT_COLOURS = {
    "foot_block": (230, 57, 70),
    "foot_wall": (157, 78, 221),
    "leg": (247, 127, 0),
    "trunk": (247, 37, 133),
}
"""Of contacts: feet by what they touch, other parts by what they are."""

_PATH, _COMMAND, _FORCE, _GOAL = (37, 99, 235), (255, 183, 3), (20, 160, 150), (34, 160, 84)
_PLANNED, _PREDICTED, _OCCUPIED = (16, 185, 129), (217, 70, 239), (8, 145, 178)
_ARC_TIME, _ARC_POINTS, _NOSE = 1.5, 13, 0.42
_FORCE_SCALE = 0.0012
"""Length of the arrow for a foot's contact force [m / N]: the robot's weight on two feet gives 13 cm each."""
_FOLLOW = 0.2
_NOWHERE = np.zeros((0, 2, 3), np.float32)
_HIDDEN = np.array([[0.0, 0.0, -100.0]], np.float32)


class SceneView:
    """The 3D part of the page. Everything hangs below one frame. To follow the robot (``follows``), that frame moves
    and not the browser's camera: whoever looks turns and zooms freely meanwhile."""

    def __init__(self, scene: viser.SceneApi) -> None:
        self._scene, self._shape = scene, RobotShape()
        self._root = scene.add_frame("/vinl", show_axes=False)
        self._home: list[Any] = []
        self._clutter: Any = None
        self._plan: FloorPlan | None = None
        self._world: World | None = None
        self._centre: np.ndarray | None = None
        self._bounds = np.array([[-5.0, -5.0], [5.0, 5.0]])  # of the plan, once there is one
        self.follows = True
        self._moving = threading.Lock()  # visitors centre the plan while the scene is drawn
        self._frames = {name: scene.add_frame(f"/vinl/robot/{name}", show_axes=False) for name in self._shape.names}
        for k, body in enumerate(self._shape.bodies):
            colour = tuple(round(255 * c) for c in body.colour)
            scene.add_mesh_simple(f"/vinl/robot/{body.body}/{k}", body.vertices, body.faces, color=colour)  # type: ignore[arg-type]
        self._goal = scene.add_frame("/vinl/goal", show_axes=False, visible=False)
        scene.add_cylinder("/vinl/goal/disc", radius=0.325, height=0.012, color=_GOAL, opacity=0.45, cast_shadow=False)
        scene.add_cylinder("/vinl/goal/pole", radius=0.012, height=0.7, color=_GOAL, position=(0, 0, 0.35))
        scene.add_icosphere("/vinl/goal/top", radius=0.05, color=_GOAL, position=(0, 0, 0.72))
        lines: dict[str, Any] = {
            name: scene.add_line_segments(f"/vinl/{name}", _NOWHERE, colour, thickness=width)
            for name, colour, width in (("path", _PATH, 0.025), ("command", _COMMAND, 0.035))
        }
        shapes: tuple[tuple[str, tuple[int, int, int], float, Literal["circle", "diamond", "square"]], ...] = (
            ("contacts", (0, 0, 0), 0.05, "circle"),
            ("planned", _PLANNED, 0.06, "circle"),
            ("predicted", _PREDICTED, 0.06, "diamond"),
            ("occupied", _OCCUPIED, 0.07, "square"),
        )
        clouds: dict[str, Any] = {
            name: scene.add_point_cloud(
                f"/vinl/{name}", _HIDDEN, colour, point_size=size, point_shape=shape, precision="float32"
            )
            for name, colour, size, shape in shapes
        }
        self._drawn: dict[str, Any] = {**lines, **clouds}
        self._drawn["forces"] = scene.add_arrows(
            "/vinl/forces", _NOWHERE, _FORCE, shaft_radius=0.008, head_radius=0.018, head_length=0.03
        )
        self._frustums: dict[str, Any] = {}
        self._shown = {name: name != "cameras" for name in LAYERS}
        self._path_length = -1
        self._contact_count = (-1, -1.0)
        self._occupied: np.ndarray | None = None

    # ---- what is asked of it ---------------------------------------------------------------------------------------

    def draw(self, snapshot: Snapshot) -> None:
        """Bring the scene to a snapshot."""
        if snapshot.world is not self._world:
            self._draw_world(snapshot.world)
        self._move_robot(snapshot.qpos)
        self._goal.visible = snapshot.goal is not None
        if snapshot.goal is not None:
            self._goal.position = (*snapshot.goal, 0.006)
        self._draw_path(snapshot.path)
        self._draw_contacts(snapshot.contacts)
        self._draw_forces(snapshot.feet, snapshot.foot_forces)
        for name in ("planned", "predicted"):
            points = getattr(snapshot.footholds, name)
            self._draw_points(name, np.zeros((0, 3)) if points is None else points)
        if snapshot.occupied is not self._occupied:
            self._occupied = snapshot.occupied
            self._draw_points("occupied", np.column_stack([self._occupied, np.full(len(self._occupied), 0.02)]))
        self._draw_command(snapshot.qpos, snapshot.command)

    def draw_images(self, images: dict[str, tuple[Camera, UInt8[np.ndarray, "h w 3"]]]) -> None:
        """Show what the cameras see at the ends of their fields of view."""
        for name, (camera, picture) in images.items():
            if name not in self._frustums:
                turn = camera.rotation()
                wxyz = _quaternion(np.stack([-turn[:, 1], -turn[:, 2], turn[:, 0]], 1))
                self._frustums[name] = self._scene.add_camera_frustum(
                    f"/vinl/robot/trunk/{name}_camera",
                    fov=2 * np.arctan(camera.tan_half[1]),
                    aspect=camera.width / camera.height,
                    scale=0.25,
                    color=(90, 90, 90),
                    wxyz=wxyz,
                    position=np.array(camera.position),
                    visible=self._shown["cameras"],
                    cast_shadow=False,
                )
            if self._shown["cameras"]:
                self._frustums[name].image = picture

    def show(self, layer: str, visible: bool) -> None:
        """Show or hide one of ``LAYERS``."""
        self._shown[layer] = visible
        names = ("planned", "predicted") if layer == "footholds" else (layer,)
        handles = self._frustums.values() if layer == "cameras" else [self._drawn[name] for name in names]
        for handle in handles:
            handle.visible = visible

    def to_world(self, point: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3"]:
        """A point of viser's scene [m] in the world of the floor plan [m]."""
        return point - np.asarray(self._root.position)

    @property
    def extent(self) -> float:
        """The longer side of the building [m]."""
        return float(np.ptp(self._bounds, axis=0).max())

    def centre_plan(self) -> None:
        """Stop following, the middle of the building in the middle."""
        middle = self._bounds.mean(0)
        with self._moving:
            self.follows, self._centre = False, middle
            self._root.position = (-middle[0], -middle[1], 0.0)

    # ---- what is drawn ---------------------------------------------------------------------------------------------

    def _draw_world(self, world: World) -> None:
        if world.plan is not self._plan:
            self._draw_plan(world.plan)
        if self._world is None or world.blocks is not self._world.blocks or self._clutter is None:
            if self._clutter is not None:
                self._clutter.remove()
                self._clutter = None
            if len(world.blocks):
                vertices, faces = box_mesh(world.blocks.boxes())
                self._clutter = self._scene.add_mesh_simple(
                    "/vinl/clutter", vertices, faces, color=_bytes(BLOCK), flat_shading=True
                )
        self._world = world

    def _draw_plan(self, plan: FloorPlan) -> None:
        for handle in self._home:
            handle.remove()
        floor, faces = inside_mesh(plan)
        self._home = [
            self._scene.add_mesh_simple("/vinl/floor", floor, faces, color=_bytes(FLOOR), cast_shadow=False),
            self._scene.add_line_segments(
                "/vinl/tiles", inside_lines(plan), _bytes(0.9 * np.array(FLOOR)), thickness=0.012
            ),
        ]
        home = plan_scene(plan, wall_height=WALL_HEIGHT, furniture_height=WALL_HEIGHT)
        colours, group = np.unique(home.colours, axis=0, return_inverse=True)
        low = home.vertices[home.faces][..., 2].min(1) < -1.0  # the hidden face of a scene without boxes
        for k, colour in enumerate(colours):
            mine = home.faces[(group.ravel() == k) & ~low]
            if len(mine):
                used, index = np.unique(mine, return_inverse=True)
                self._home.append(
                    self._scene.add_mesh_simple(
                        f"/vinl/home/{k}",
                        home.vertices[used],
                        index.reshape(-1, 3),
                        color=_bytes(colour),
                        flat_shading=True,
                    )
                )
        cells = np.argwhere(plan.inside)
        self._plan, self._centre = plan, None
        self._bounds = plan.frame.xy(np.stack([cells.min(0), cells.max(0)]))

    def _move_robot(self, qpos: Float[np.ndarray, "19"]) -> None:
        positions, rotations = self._shape.place(qpos)
        for name, position, rotation in zip(self._shape.names, positions, rotations, strict=True):
            frame = self._frames[name]
            frame.position, frame.wxyz = position, _quaternion(rotation)
        with self._moving:
            if not self.follows:
                return
            at, before = qpos[:2], self._centre
            if before is None or np.linalg.norm(at - before) > 1.0:
                before = at.copy()
            self._centre = before + _FOLLOW * (at - before)
            self._root.position = (-self._centre[0], -self._centre[1], 0.0)

    def _draw_path(self, path: Float[np.ndarray, "k 2"]) -> None:
        if len(path) // 2 == self._path_length:
            return
        self._path_length = len(path) // 2
        points = np.column_stack([path[::2], np.full(len(path[::2]), 0.015)]).astype(np.float32)
        self._drawn["path"].points = np.stack([points[:-1], points[1:]], 1) if len(points) > 1 else _NOWHERE

    def _draw_contacts(self, contacts: Float[np.ndarray, "m 5"]) -> None:
        count = (len(contacts), float(contacts[-1, 0]) if len(contacts) else 0.0)
        if count == self._contact_count:
            return
        self._contact_count = count
        colours = [
            CONTACT_COLOURS.get(KINDS[int(k)]) or CONTACT_COLOURS[KINDS[int(k)].split("_")[0]] for k in contacts[:, 1]
        ]
        self._draw_points("contacts", contacts[:, 2:])
        if len(contacts):
            self._drawn["contacts"].colors = np.array(colours, np.uint8)

    def _draw_forces(self, feet: Float[np.ndarray, "4 3"], forces: Float[np.ndarray, "4"]) -> None:
        loaded = forces > 5.0
        base = feet[loaded] + [0.0, 0.0, 0.04]
        tip = base + np.stack([0 * forces, 0 * forces, 0.05 + _FORCE_SCALE * forces], 1)[loaded]
        self._drawn["forces"].points = np.stack([base, tip], 1).astype(np.float32)

    def _draw_points(self, name: str, points: Float[np.ndarray, "n 3"]) -> None:
        """A cloud of points; without any, one far below the floor: browsers refuse empty clouds."""
        self._drawn[name].points = (points if len(points) else _HIDDEN).astype(np.float32)

    def _draw_command(self, qpos: Float[np.ndarray, "19"], command: Float[np.ndarray, "3"]) -> None:
        """Where the command would bring the robot's nose in a second and a half."""
        if not command.any():
            self._drawn["command"].points = _NOWHERE
            return
        t = np.linspace(0.0, _ARC_TIME, _ARC_POINTS)
        yaw = float(yaw_of(np, qpos[3:7])) + command[2] * t
        step = (t[1] - t[0]) * (command[0] * np.stack([np.cos(yaw), np.sin(yaw)], 1))
        middle = qpos[:2] + np.concatenate([np.zeros((1, 2)), np.cumsum(step, 0)[:-1]])
        nose = middle + _NOSE * np.stack([np.cos(yaw), np.sin(yaw)], 1)
        points = np.column_stack([nose, np.full(len(t), 0.03)]).astype(np.float32)
        self._drawn["command"].points = np.stack([points[:-1], points[1:]], 1)


def _quaternion(rotation: Float[np.ndarray, "3 3"]) -> Float[np.ndarray, "4"]:
    wxyz = np.empty(4)
    mujoco.mju_mat2Quat(wxyz, np.ascontiguousarray(rotation, np.float64).ravel())
    return wxyz


def _bytes(colour: Any) -> tuple[int, int, int]:
    red, green, blue = (round(255 * float(c)) for c in colour)
    return red, green, blue
