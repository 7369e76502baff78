"""How many depth images a second, over houses, beside a bare kernel that only casts the same rays."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from typing import Any

import numpy as np
import torch
import warp as wp
from scipy.spatial.transform import Rotation

from vinl.robot.cameras import Camera
from vinl.sensing.depth import DepthCamera, check_device
from vinl.sensing.kernels import cast_rays
from vinl.sensing.torch_warp import launch
from vinl.world.boxes import Boxes
from vinl.world.grid import GridFrame
from vinl.world.mesh import box_mesh, floor_mesh, join_meshes

_SIDE = (12.0, 9.0)
_ROOMS = (3, 2)
_WALL, _DOOR, _CEILING = 0.12, 0.9, 2.5
_HEIGHT = 0.38


def run_depth(
    num_images: int | None = None,
    width: int = 64,
    height: int = 64,
    device: str = "cuda",
    seconds: float = 2.0,
    homes: int = 8,
) -> dict[str, Any]:
    """Measure the depth camera over so many homes of about 80 boxes, seen from random places in their rooms, for so
    many seconds; by default 4096 images a launch on a GPU and 32 on a CPU.

    ``images_per_s`` is the camera's, from trunk poses to depth; ``bare_images_per_s`` that of a kernel that reads
    finished rays and writes their length; ``share`` the first over the second; ``triangles`` are those of all homes.
    Raises ``InputError`` if the GPU is not there.
    """
    chosen = check_device(device)
    num_images = (4096 if chosen.type == "cuda" else 32) if num_images is None else num_images
    rng = np.random.default_rng(0)
    meshes = [_draw_home(rng) for _ in range(homes)]
    record = Camera("navigation", (0.35, 0.0, 0.0), math.radians(-15), math.radians(70), width, height, 10.0)
    camera = DepthCamera(meshes, record, device=chosen, dtype=torch.float16)  # as the navigator reads it
    world, position, rotation = _draw_poses(rng, num_images, homes, chosen)
    out = camera.render(world, position, rotation)

    images = _rate(lambda: camera.render(world, position, rotation, out=out), chosen, seconds) * num_images
    bare = _rate(_bare_launch(camera, world, position, rotation), chosen, seconds) * num_images
    return {
        "images_per_s": images,
        "bare_images_per_s": bare,
        "share": images / bare,
        "num_images": num_images,
        "width": width,
        "height": height,
        "homes": homes,
        "triangles": sum(len(faces) for _, faces in meshes),
        "device": torch.cuda.get_device_name(chosen) if chosen.type == "cuda" else "cpu",
        "warp": wp.config.version,
    }


def _rate(work: Callable[[], Any], device: torch.device, seconds: float) -> float:
    """Launches a second, after three to warm up (the first compiles)."""
    wait = (lambda: torch.cuda.synchronize(device)) if device.type == "cuda" else (lambda: None)
    for _ in range(3):
        work()
    wait()
    count, batch, start = 0, 20 if device.type == "cuda" else 1, time.perf_counter()
    while True:
        for _ in range(batch):
            work()
        wait()
        count += batch
        passed = time.perf_counter() - start
        if passed >= seconds:
            return count / passed


def _bare_launch(
    camera: DepthCamera, world: torch.Tensor, position: torch.Tensor, rotation: torch.Tensor
) -> Callable[[], None]:
    """The rays of the same images, finished beforehand; the function casts them."""
    record, device = camera.camera, camera.device
    tx, ty = record.tan_half
    left = tx * (1 - (2 * torch.arange(record.width, device=device) + 1) / record.width)
    up = ty * (1 - (2 * torch.arange(record.height, device=device) + 1) / record.height)
    grid = torch.stack(torch.broadcast_tensors(torch.ones(1, 1, device=device), left[None, :], up[:, None]), -1)
    turn = torch.as_tensor(record.rotation(), dtype=torch.float32, device=device)
    mount = torch.tensor(record.position, dtype=torch.float32, device=device)
    pixels = record.width * record.height
    direction = torch.einsum("nij,hwj->nhwi", rotation @ turn, grid).reshape(-1, 3).contiguous()
    origin = (position + rotation @ mount).repeat_interleave(pixels, 0).contiguous()
    worlds = world.to(torch.int32).repeat_interleave(pixels).contiguous()
    distance = torch.empty(len(origin), device=device)
    inputs = [
        camera.mesh_ids,
        wp.from_torch(worlds),
        wp.from_torch(origin, dtype=wp.vec3),
        wp.from_torch(direction, dtype=wp.vec3),
        record.far,
    ]
    outputs = [wp.from_torch(distance)]
    return lambda: launch(cast_rays, len(distance), inputs, device, outputs)


def _draw_home(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Six rooms with doors, about ten pieces of furniture in each, floor and ceiling: about 80 boxes."""
    size = np.array(_SIDE) / _ROOMS
    rows: list[list[float]] = []
    for axis, other in ((0, 1), (1, 0)):  # one room's side of a wall: a box, or with a door two boxes and a lintel
        for line, room in np.ndindex(_ROOMS[axis] + 1, _ROOMS[other]):
            length = float(size[other])
            parts = [(0.0, length, 0.0)]
            if 0 < line < _ROOMS[axis]:
                a = rng.uniform(0.3, length - 0.3 - _DOOR)
                parts = [(0.0, a, 0.0), (a, a + _DOOR, 2.0), (a + _DOOR, length, 0.0)]
            for low, high, bottom in parts:
                middle = np.array([line * size[axis], room * length + (low + high) / 2])[[axis, other]]
                rows.append([*middle, math.pi / 2 * other, high - low, _WALL, bottom, _CEILING])
    for room in np.ndindex(*_ROOMS):
        low, high = room * size, (np.array(room) + 1) * size
        for _ in range(10):
            # Furniture stands along the walls; the middle of the room stays free for the cameras.
            at, extent = rng.uniform(low + 0.4, high - 0.4), rng.uniform([0.3, 0.3], [0.9, 0.6])
            axis = rng.integers(2)
            at[axis] = rng.choice([low[axis] + 0.35, high[axis] - 0.35])
            yaw = rng.choice([0.0, math.pi / 2]) + rng.normal(0, 0.05)
            rows.append([*at, yaw, *extent, 0.0, rng.choice([0.45, 0.75, 0.9, 1.8])])
    frame = GridFrame(0.5, 0.5, 1.0, (int(_SIDE[1]), int(_SIDE[0])))
    return join_meshes(box_mesh(Boxes(np.array(rows))), floor_mesh(frame), floor_mesh(frame, _CEILING, up=False))


def _draw_poses(
    rng: np.random.Generator, n: int, homes: int, device: torch.device
) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
    """Trunks in the middle of rooms, any heading, a walking robot's tilt."""
    size = np.array(_SIDE) / _ROOMS
    room = np.column_stack([rng.integers(count, size=n) for count in _ROOMS])
    xy = (room + 0.5) * size + rng.uniform(-0.5, 0.5, (n, 2)) * (size - 2.2)
    position = np.column_stack([xy, np.full(n, _HEIGHT)])
    yaw_pitch_roll = np.stack([rng.uniform(-math.pi, math.pi, n), rng.normal(0, 0.05, n), rng.normal(0, 0.05, n)], 1)
    turned = Rotation.from_euler("ZYX", yaw_pitch_roll).as_matrix()
    return (
        torch.as_tensor(rng.integers(homes, size=n), device=device),
        torch.as_tensor(position, dtype=torch.float32, device=device),
        torch.as_tensor(turned, dtype=torch.float32, device=device),
    )
