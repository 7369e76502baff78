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

    Raises:
        InputError: the GPU is not there.
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
    (length, width), (columns, rows) = _SIDE, _ROOMS
    rows_of = []
    for k in range(columns + 1):
        for r in range(rows):
            rows_of += _wall(rng, k * length / columns, r * width / rows, width / rows, True, 0 < k < columns)
    for r in range(rows + 1):
        for k in range(columns):
            rows_of += _wall(rng, r * width / rows, k * length / columns, length / columns, False, 0 < r < rows)
    for k in range(columns):
        for r in range(rows):
            low = np.array([k * length / columns, r * width / rows])
            high = low + np.array([length / columns, width / rows])
            for _ in range(10):
                # Furniture stands along the walls; the middle of the room stays free for the cameras.
                at, size = rng.uniform(low + 0.4, high - 0.4), rng.uniform([0.3, 0.3], [0.9, 0.6])
                axis = rng.integers(2)
                at[axis] = rng.choice([low[axis] + 0.35, high[axis] - 0.35])
                yaw = rng.choice([0.0, math.pi / 2]) + rng.normal(0, 0.05)
                rows_of.append([*at, yaw, *size, 0.0, rng.choice([0.45, 0.75, 0.9, 1.8])])
    boxes = Boxes(np.array(rows_of))
    frame = GridFrame(0.5, 0.5, 1.0, (int(width), int(length)))
    return join_meshes(box_mesh(boxes), floor_mesh(frame), floor_mesh(frame, _CEILING, up=False))


def _wall(rng: np.random.Generator, across: float, start: float, length: float, along_y: bool, door: bool) -> list:
    """One room's side of a wall: a box, or with a door two boxes and a lintel."""
    if door:
        a = rng.uniform(0.3, length - 0.3 - _DOOR)
        parts = [(0.0, a, 0.0), (a, a + _DOOR, 2.0), (a + _DOOR, length, 0.0)]
    else:
        parts = [(0.0, length, 0.0)]
    found = []
    for low, high, bottom in parts:
        middle, size = start + (low + high) / 2, high - low
        xy = (across, middle) if along_y else (middle, across)
        found.append([*xy, math.pi / 2 if along_y else 0.0, size, _WALL, bottom, _CEILING])
    return found


def _draw_poses(
    rng: np.random.Generator, n: int, homes: int, device: torch.device
) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
    """Trunks in the middle of rooms, any heading, a walking robot's tilt."""
    (length, width), (columns, rows) = _SIDE, _ROOMS
    size = np.array([length / columns, width / rows])
    room = np.column_stack([rng.integers(columns, size=n), rng.integers(rows, size=n)])
    xy = (room + 0.5) * size + rng.uniform(-0.5, 0.5, (n, 2)) * (size - 2.2)
    position = np.column_stack([xy, np.full(n, _HEIGHT)])
    yaw_pitch_roll = np.stack([rng.uniform(-math.pi, math.pi, n), rng.normal(0, 0.05, n), rng.normal(0, 0.05, n)], 1)
    turned = Rotation.from_euler("ZYX", yaw_pitch_roll).as_matrix()
    return (
        torch.as_tensor(rng.integers(homes, size=n), device=device),
        torch.as_tensor(position, dtype=torch.float32, device=device),
        torch.as_tensor(turned, dtype=torch.float32, device=device),
    )
