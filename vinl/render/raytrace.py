"""A renderer for videos and the pictures in the docs: shaded rays by Warp on the CPU, no OpenGL anywhere."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import warp as wp
from jaxtyping import Float, UInt8

from vinl.render.picture_kernels import render_picture
from vinl.render.scene import BodyMesh, Scene
from vinl.sensing.depth import build_mesh
from vinl.sensing.kernels import cast_rays

_CREASE = math.radians(35)
_FAR = 80.0
_SUN = np.array([0.35, -0.45, 0.82])


@dataclass(frozen=True, eq=False)
class View:
    """Where a camera is: its position in the world [m], and its rotation, camera to world, whose columns are forward,
    left and up."""

    position: Float[np.ndarray, " 3"]
    rotation: Float[np.ndarray, "3 3"]


def look_at(eye: Sequence[float] | np.ndarray, target: Sequence[float] | np.ndarray) -> View:
    """A camera at ``eye`` [m] that looks at ``target`` [m], the horizon level."""
    position = np.asarray(eye, dtype=np.float64)
    forward = np.asarray(target, dtype=np.float64) - position
    forward /= np.linalg.norm(forward)
    left = np.cross([0.0, 0.0, 1.0], forward)
    left = np.array([0.0, 1.0, 0.0]) if np.linalg.norm(left) < 1e-6 else left / np.linalg.norm(left)
    return View(position, np.stack([forward, left, np.cross(forward, left)], -1))


class RayRenderer:
    """Pictures of a world that does not move and of a robot that does, of which there may be none. ``names`` is the
    order in which ``render`` gets the frames of the bodies; the order of first use by default."""

    def __init__(self, scene: Scene, bodies: Sequence[BodyMesh] = (), names: Sequence[str] | None = None) -> None:
        self.names = tuple(dict.fromkeys(body.body for body in bodies)) if names is None else tuple(names)
        self._world = build_mesh(scene.vertices, scene.faces, "cpu")
        self._colours = _array(scene.colours, wp.vec3)
        edge = np.array([[-0.5, -0.5], np.array(scene.floor.shape[::-1]) - 0.5]) * scene.floor.resolution
        low, high = edge + np.array([scene.floor.x0, scene.floor.y0])
        self._floor = [wp.vec2(*low), wp.vec2(*high), wp.vec3(*scene.floor_colour), scene.checker]
        self._meshes = [build_mesh(body.vertices, body.faces, "cpu") for body in bodies]
        centres = [(body.vertices.min(0) + body.vertices.max(0)) / 2 for body in bodies]
        radii = [np.linalg.norm(b.vertices - c, axis=1).max() for b, c in zip(bodies, centres, strict=True)]
        first = np.cumsum([0, *[len(body.faces) for body in bodies]])[:-1]
        normals = [_corner_normals(body.vertices, body.faces) for body in bodies] or [np.zeros((1, 3))]
        self._frame_of = np.array([self.names.index(body.body) for body in bodies], dtype=np.int64)
        self._centres, self._radii = np.array(centres).reshape(-1, 3), np.array(radii)
        self._body_inputs = [
            _array([mesh.id for mesh in self._meshes], wp.uint64),
            _array(self._frame_of, int),
            _array(np.array([body.colour for body in bodies]).reshape(-1, 3), wp.vec3),
            _array(self._centres, wp.vec3),
            _array(self._radii, float),
            _array(first, int),
            _array(np.concatenate(normals), wp.vec3),
        ]

    def render(
        self,
        view: View,
        width: int,
        height: int,
        positions: Float[np.ndarray, "b 3"] | None = None,
        rotations: Float[np.ndarray, "b 3 3"] | None = None,
        hfov: float = math.radians(60),
        shadows: int = 1,
        samples: int = 1,
    ) -> UInt8[np.ndarray, "height width 3"]:
        """One picture of width x height pixels, red, green, blue.

        ``positions`` [m] and ``rotations`` (body to world) of the bodies are in the order of ``names``, see
        ``RobotShape.place`` (``ValueError`` if they do not fit); without them the robot is not there. ``hfov`` is the
        horizontal field of view [rad]. ``shadows``: 0 none, 1 the robot's (fast), 2 everything's. ``samples``: rays
        along each side of a pixel; 2 smooths the edges at four times the cost.
        """
        body_inputs = self._body_inputs
        if positions is None or rotations is None:
            positions, rotations = np.zeros((0, 3)), np.zeros((0, 3, 3))
            body_inputs = [wp.empty(0, dtype=array.dtype, device="cpu") for array in body_inputs]
            centre, radius = np.zeros(3), 0.0
        elif len(positions) != len(self.names) or len(rotations) != len(self.names):
            raise ValueError(f"{len(self.names)} bodies, but {len(positions)} positions, {len(rotations)} rotations")
        else:
            centre, radius = self._enclose(positions, rotations)
        picture = np.empty((height, width, 3), np.uint8)
        tan = math.tan(hfov / 2)
        wp.launch(
            render_picture,
            dim=(height, width),
            inputs=[
                self._world.id,
                self._colours,
                *self._floor,
                *body_inputs,
                _array(np.ascontiguousarray(positions, np.float32), wp.vec3),
                _array(np.ascontiguousarray(rotations, np.float32), wp.mat33),
                wp.vec3(*centre),
                radius,
                wp.vec3(*view.position),
                wp.mat33(*view.rotation.ravel()),
                wp.vec2(tan, tan * height / width),
                wp.vec3(*(_SUN / np.linalg.norm(_SUN))),
                _FAR,
                shadows,
                samples,
            ],
            outputs=[wp.array(picture, dtype=wp.uint8, device="cpu", copy=False)],
            device="cpu",
        )
        return picture

    def sees(self, eye: np.ndarray, target: np.ndarray) -> bool:
        """Whether nothing of the world lies between two points [m]."""
        way = np.asarray(target, np.float64) - np.asarray(eye, np.float64)
        worlds, numbers, query = _array([self._world.id], wp.uint64), _array([0], int), _array([0.0], float)
        rays = _array([eye], wp.vec3), _array([way], wp.vec3)
        wp.launch(cast_rays, 1, [worlds, numbers, *rays, 1.0], [query], device="cpu")
        return bool(query.numpy()[0] >= 1.0)

    def _enclose(self, positions: np.ndarray, rotations: np.ndarray) -> tuple[np.ndarray, float]:
        """A ball around the whole robot: what misses it need not be tried against every body."""
        frames = self._frame_of
        centres = positions[frames] + np.einsum("nij,nj->ni", rotations[frames], self._centres)
        middle = (centres.min(0) + centres.max(0)) / 2
        return middle, float((np.linalg.norm(centres - middle, axis=1) + self._radii).max())


def _array(values: Any, kind: Any) -> wp.array:
    return wp.array(values, dtype=kind, device="cpu")


def _corner_normals(vertices: np.ndarray, faces: np.ndarray) -> Float[np.ndarray, "c 3"]:
    """Normals at the three corners of every face, rounded over edges that are flatter than the crease angle."""
    corners = vertices[faces].astype(np.float64)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    areas = np.linalg.norm(normals, axis=1, keepdims=True)
    unit = normals / np.maximum(areas, 1e-20)
    # Vertices may be stored once for each face (STL): what counts is where they are.
    _, point = np.unique(np.round(corners.reshape(-1, 3), 6), axis=0, return_inverse=True)
    point = point.reshape(-1, 3)
    order = np.argsort(point.ravel(), kind="stable")
    bounds = np.searchsorted(point.ravel()[order], np.arange(point.max() + 2))
    result = np.repeat(unit, 3, axis=0)
    for k in range(len(bounds) - 1):
        at = order[bounds[k] : bounds[k + 1]]
        face = at // 3
        like = unit[face] @ unit[face].T > math.cos(_CREASE)
        mean = like @ (normals[face])
        result[at] = mean / np.maximum(np.linalg.norm(mean, axis=1, keepdims=True), 1e-20)
    return result


class ChaseCamera:
    """Follows at a distance [m], from behind and an elevation above the horizon [rad]; rises, then comes closer, where
    a wall or a cupboard would hide the robot. Without a renderer, which knows the walls, the camera flies freely.

    At each call it covers a fraction ``smoothing`` of the way to the wanted pose, with 1 all of it.
    """

    def __init__(
        self,
        renderer: RayRenderer | None = None,
        distance: float = 2.5,
        elevation: float = math.radians(38),
        smoothing: float = 0.08,
    ) -> None:
        self._renderer, self._distance, self._elevation = renderer, distance, elevation
        self._smoothing = smoothing
        self._state: np.ndarray | None = None

    def follow(self, trunk: Float[np.ndarray, " 3"], yaw: float) -> View:
        """The camera's pose for the trunk's position [m] and heading [rad]; call it once a frame."""
        target = np.array([trunk[0], trunk[1], 0.3])
        if self._state is None:
            self._state = np.array([*target, yaw, *self._choose(target, yaw)])
        kept = self._state
        step = self._smoothing
        kept[:3] += min(1.0, 3 * step) * (target - kept[:3])
        kept[3] += step * math.remainder(yaw - kept[3], 2 * math.pi)
        elevation, distance = self._choose(kept[:3], kept[3])
        # Up at once when hidden soon, down at leisure.
        kept[4] += (step if elevation < kept[4] else min(1.0, 2.5 * step)) * (elevation - kept[4])
        kept[5] += step * (distance - kept[5])
        return look_at(self._eye(kept[:3], *kept[3:]), kept[:3])

    def _choose(self, target: np.ndarray, yaw: float) -> tuple[float, float]:
        """The lowest elevation [rad], and then the longest distance [m], from which the robot is seen."""
        if self._renderer is None:
            return self._elevation, self._distance
        side = 0.2 * np.array([-math.sin(yaw), math.cos(yaw), 0.0])
        for fraction in (1.0, 0.75):
            for elevation in np.linspace(self._elevation, math.radians(78), 6):
                eye = self._eye(target, yaw, elevation, fraction * self._distance)
                if all(self._renderer.sees(eye, target + shift) for shift in (side, -side)):
                    return float(elevation), fraction * self._distance
        return math.radians(85), self._distance

    @staticmethod
    def _eye(target: np.ndarray, yaw: float, elevation: float, distance: float) -> np.ndarray:
        flat = distance * math.cos(elevation)
        return target + np.array([-flat * math.cos(yaw), -flat * math.sin(yaw), distance * math.sin(elevation)])
