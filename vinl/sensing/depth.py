"""The depth camera: rays against triangle meshes, many worlds and many robots in one launch, on CPU or GPU."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import torch
import warp as wp
from jaxtyping import Float

from vinl.config.errors import InputError
from vinl.robot.cameras import Camera
from vinl.sensing.kernels import render_depth
from vinl.sensing.torch_warp import find_stream

Mesh = tuple[np.ndarray, np.ndarray]
"""Vertices (v, 3) [m] and faces (f, 3)."""


def build_mesh(vertices: np.ndarray, faces: np.ndarray, device: str, tree: str | None = None) -> wp.Mesh:
    """A mesh with its ray tree on the device, built in Warp's way of that name, by default of its own choice. Raises
    ``InputError`` if there is no face, a face names a vertex that is not there, or a vertex is not finite."""
    vertices, faces = np.asarray(vertices, np.float32), np.asarray(faces, np.int32)
    if vertices.ndim != 2 or faces.ndim != 2 or vertices.shape[1:] != (3,) or faces.shape[1:] != (3,) or not len(faces):
        raise InputError(f"a mesh needs (v, 3) vertices and (f, 3) faces, got {vertices.shape} and {faces.shape}")
    if not np.isfinite(vertices).all() or faces.min() < 0 or faces.max() >= len(vertices):
        raise InputError("a mesh has a vertex that is not finite or a face that names no vertex")
    points = wp.array(np.ascontiguousarray(vertices), dtype=wp.vec3, device=device)
    indices = wp.array(faces.ravel(), dtype=wp.int32, device=device)
    return wp.Mesh(points=points, indices=indices, bvh_constructor=tree)


def check_device(device: str | torch.device) -> torch.device:
    """The device, with its number. Raises ``InputError`` if it is a GPU that is not there."""
    chosen = torch.device(device)
    if chosen.type == "cuda":
        if not torch.cuda.is_available() or not wp.is_cuda_available():
            raise InputError("device cuda: no CUDA device is available here; use device cpu")
        return torch.device("cuda", torch.cuda.current_device() if chosen.index is None else chosen.index)
    return chosen


class DepthCamera:
    """A depth camera that looks into any of several worlds, whose meshes are vertices (v, 3) [m] and faces (f, 3), see
    ``vinl.world.mesh``.

    Depth, float32 or float16, is metres along the optical axis (planar, not along the ray); nothing hit, or farther
    than the camera's far limit, reads as the far limit. The robot's own body is not there. ``floor`` is the height of a
    level floor without end that the meshes leave out [m], which makes rays a third quicker; None: what there is of
    floor is in the meshes. ``mesh_ids`` are Warp's handles of the meshes, for kernels of one's own. Raises
    ``InputError`` if there is no mesh, a broken mesh, a dtype that is neither of the two, or a GPU that is not there.
    """

    def __init__(
        self,
        meshes: Sequence[Mesh],
        camera: Camera,
        device: str | torch.device = "cpu",
        dtype: torch.dtype = torch.float32,
        floor: float | None = None,
    ) -> None:
        if not meshes:
            raise InputError("a depth camera needs at least one mesh to look at")
        if dtype not in (torch.float16, torch.float32):
            raise InputError(f"depth is float32 or float16, not {dtype}")
        self.camera, self._floor = camera, -np.inf if floor is None else floor
        self.device = check_device(device)
        self.dtype = dtype
        self._warp_device = str(self.device)
        self._meshes = [build_mesh(vertices, faces, self._warp_device) for vertices, faces in meshes]
        self.mesh_ids = wp.array([mesh.id for mesh in self._meshes], dtype=wp.uint64, device=self._warp_device)
        self._mount = self._on_device(np.array(camera.position))
        self._turn = self._on_device(camera.rotation())

    def __len__(self) -> int:
        """How many worlds there are."""
        return len(self._meshes)

    def render(
        self, world: Any, position: Any, rotation: Any, out: torch.Tensor | None = None
    ) -> Float[torch.Tensor, "n height width"]:
        """What the camera on each robot sees [m]: in ``world`` (n,), whose range is not checked on a GPU tensor, from
        the trunk's ``position`` (n, 3) [m] and ``rotation`` (n, 3, 3), trunk to world. It is written into ``out``, of
        the camera's device and dtype, or a new tensor; on a GPU in order with torch's current stream. Raises
        ``InputError`` if a shape does not fit, or a world does not exist."""
        position, rotation = self._on_device(position), self._on_device(rotation)
        _check_shapes(world, position, rotation)
        return self.render_poses(world, position + rotation @ self._mount, rotation @ self._turn, out=out)

    def render_poses(
        self, world: Any, position: Any, rotation: Any, out: torch.Tensor | None = None
    ) -> Float[torch.Tensor, "n height width"]:
        """As ``render``, from the camera's own poses, for mounts that differ from image to image: the optical centre
        [m], and camera to world, whose columns are forward, left and up. Raises ``InputError`` if a shape does not fit,
        or a world does not exist."""
        position, rotation = self._on_device(position), self._on_device(rotation)
        _check_shapes(world, position, rotation)
        shape = len(position), self.camera.height, self.camera.width
        if out is None:
            out = torch.empty(shape, dtype=self.dtype, device=self.device)
        elif out.shape != shape or out.dtype != self.dtype or out.device != self.device or not out.is_contiguous():
            raise InputError(f"out needs shape {shape}, {self.dtype}, {self.device}, contiguous")
        if not len(position):
            return out
        self.launch(
            wp.from_torch(self._world(world), dtype=wp.int32),
            wp.from_torch(position.contiguous(), dtype=wp.vec3),
            wp.from_torch(rotation.contiguous(), dtype=wp.mat33),
            wp.from_torch(out),
        )
        return out

    def launch(self, world: wp.array, position: wp.array, rotation: wp.array, out: wp.array, **options: Any) -> Any:
        """Launch the kernel on Warp's arrays as in ``render_poses``, unchecked; ``options`` of ``wp.launch``."""
        view = wp.vec2(*self.camera.tan_half), self.camera.far, self._floor
        return wp.launch(
            render_depth,
            dim=out.shape,
            inputs=[self.mesh_ids, world, position, rotation, *view],
            outputs=[out],
            device=self._warp_device,
            stream=find_stream(self.device),
            **options,
        )

    def _on_device(self, values: Any) -> torch.Tensor:
        return torch.as_tensor(values, dtype=torch.float32, device=self.device).detach()

    def _world(self, world: Any) -> torch.Tensor:
        # A look at numbers on the GPU would make the host wait for it, so only what lies here is checked.
        on_gpu = isinstance(world, torch.Tensor) and world.device.type != "cpu"
        if not on_gpu:
            numbers = np.asarray(world)
            if len(numbers) and (numbers.min() < 0 or numbers.max() >= len(self)):
                raise InputError(
                    f"world {numbers.min()}..{numbers.max()} is out of range, there are {len(self)} worlds"
                )
        return torch.as_tensor(world, device=self.device).to(torch.int32).contiguous()


def _check_shapes(world: Any, position: torch.Tensor, rotation: torch.Tensor) -> None:
    n = len(world)
    if tuple(position.shape) != (n, 3) or tuple(rotation.shape) != (n, 3, 3):
        raise InputError(
            f"{n} worlds need positions ({n}, 3) and rotations ({n}, 3, 3), "
            f"got {tuple(position.shape)} and {tuple(rotation.shape)}"
        )


class PreparedRender:
    """``DepthCamera.render_poses`` of always n images of float32 on the CPU, into the same place.

    For one image of 64 x 36 pixels, wrapping arrays and checking arguments takes as long as the rays themselves.
    """

    def __init__(self, depth: DepthCamera, n: int) -> None:
        if depth.device.type != "cpu" or depth.dtype != torch.float32:
            raise ValueError(f"renders float32 on the CPU are prepared, not {depth.dtype} on {depth.device}")
        self._depth = depth  # its meshes must live as long as the launch
        camera = depth.camera
        self._world, self._position = np.zeros(n, np.int32), np.zeros((n, 3), np.float32)
        self._rotation = np.zeros((n, 3, 3), np.float32)
        self._images = np.zeros((n, camera.height, camera.width), np.float32)
        self._answer = torch.from_numpy(self._images)
        self._launch: Any = depth.launch(
            _share(self._world, wp.int32),
            _share(self._position, wp.vec3),
            _share(self._rotation, wp.mat33),
            _share(self._images, wp.float32),
            record_cmd=True,
        )

    def __call__(
        self,
        world: Sequence[int] | np.ndarray,
        position: Float[np.ndarray, "n 3"],
        rotation: Float[np.ndarray, "n 3 3"],
    ) -> Float[torch.Tensor, "n height width"]:
        """Depth [m] as in ``render_poses``, overwritten by the next call. Whether there are so many worlds is not
        checked."""
        self._world[:], self._position[:], self._rotation[:] = world, position, rotation
        self._launch.launch()
        return self._answer


def _share(values: np.ndarray, kind: type) -> wp.array:
    return wp.array(values, dtype=kind, device="cpu", copy=False)
