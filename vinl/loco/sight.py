"""The student's eyes in training: one camera a robot, each a little off, late, noisy and with holes."""

from __future__ import annotations

from typing import Any

import numpy as np
import torch
from jaxtyping import Float, Int, Shaped
from torch import Tensor
from torch.nn import functional

from vinl.loco.student_config import SightConfig
from vinl.robot.aliengo import CONTROL_DT
from vinl.robot.cameras import Camera
from vinl.robot.rotation import matrix_of
from vinl.sensing.depth import DepthCamera, Mesh
from vinl.world.grid import GROUND, GridFrame
from vinl.world.mesh import box_mesh, heightfield_mesh, join_meshes
from vinl.world.terrain import Terrain

_PAST = 3
"""Poses that are kept, the newest first."""

_DRAWS = 10
"""Uniform numbers in [-1, 1) that an episode's camera takes: position 3, angles 3, zoom, scale, holes, delay."""


class Sight:
    """Depth images of all robots, normalised by the camera record, on the device; nothing waits for it.

    Everything random follows from the seed and the count of images, so that a resumed training sees the same.

    Args:
        mesh: of the world that all robots share.
        camera: the record.
        config: how far off the cameras are.
        n: robots.
        device: torch device.
        seed: of everything random.
    """

    def __init__(self, mesh: Mesh, camera: Camera, config: SightConfig, n: int, device: str, seed: int) -> None:
        self.camera, self.config = camera, config
        self._depth = DepthCamera([mesh], camera, device=device, dtype=torch.float16)
        self._device = self._depth.device
        self._world = torch.zeros(n, dtype=torch.int32, device=self._device)
        self._mount = torch.tensor(camera.position, dtype=torch.float32, device=self._device)
        self._turn = torch.tensor(camera.rotation(), dtype=torch.float32, device=self._device)
        self._tan = torch.tensor([camera.tan_half], dtype=torch.float32, device=self._device)
        self._generator = torch.Generator(self._device)
        self._seed, self._count = seed, 0
        self._draws = self._draw_cameras(n)
        self._past = torch.zeros(_PAST, n, 7, device=self._device)
        self._seen = False

    def look(self, pose: Float[Tensor, "n 7"], done: Shaped[Tensor, " n"] | None) -> Float[Tensor, "n height width"]:
        """What the robots see now.

        Args:
            pose: (n, 7) position [m] and quaternion of the trunks.
            done: (n,) not zero where an episode begins with this image; None: no time has passed since the last one.

        Returns:
            (n, H, W) float16 in [0, 1].
        """
        if done is not None:
            self._count += 1
            fresh = done.bool()[:, None]
            past = torch.cat([pose[None], self._past[:-1]])
            self._past = torch.where(fresh, pose, past)
            self._draws = torch.where(fresh, self._draw_cameras(len(pose)), self._draws)
        elif not self._seen:  # nobody has a past yet
            self._past = pose.expand(_PAST, -1, -1).clone()
        self._seen = True
        low, high = self.config.delay
        late = (low + (high - low) * (self._draws[:, 9] + 1) / 2) / CONTROL_DT
        steps = late.round().long().clamp(0, _PAST - 1)
        depth = self._render(self._past[steps, torch.arange(len(pose), device=self._device)])
        return self.camera.normalise(self._spoil(depth))

    def save_state(self) -> dict[str, Any]:
        """What ``load_state`` takes back."""
        return {"past": self._past.cpu(), "draws": self._draws.cpu(), "count": self._count}

    def load_state(self, state: dict[str, Any]) -> None:
        """See on as before."""
        self._past, self._draws = state["past"].to(self._device), state["draws"].to(self._device)
        self._count, self._seen = state["count"], True

    def _seeded(self, purpose: int) -> torch.Generator:
        return self._generator.manual_seed(self._seed * 1_000_000_007 + 2 * self._count + purpose)

    def _draw_cameras(self, n: int) -> Float[Tensor, "n 10"]:
        return 2 * torch.rand(n, _DRAWS, device=self._device, generator=self._seeded(0)) - 1

    def _render(self, pose: Float[Tensor, "n 7"]) -> Float[Tensor, "n height width"]:
        c, d = self.config, self._draws
        trunk = matrix_of(torch, pose[:, 3:])
        offset = self._mount + c.position * d[:, :3]
        place = pose[:, :3] + (trunk @ offset[..., None])[..., 0]
        turn = trunk @ self._turn @ _small_turn(c.angle * d[:, 3:6])
        return self._depth.render_poses(self._world, place, turn, self._tan * (1 + c.zoom * d[:, 6:7]))

    def _spoil(self, depth: Float[Tensor, "n height width"]) -> Float[Tensor, "n height width"]:
        """Scale, noise and holes."""
        c = self.config
        generator = self._seeded(1)
        if c.scale or c.noise:
            factor = (1 + c.scale * self._draws[:, 7, None, None]).to(depth.dtype)
            rough = torch.randn(depth.shape, device=depth.device, dtype=depth.dtype, generator=generator)
            depth = torch.where(depth < self.camera.far, depth * (factor + c.noise * rough), depth)
        if c.holes:
            rows, columns = (-(-k // c.hole_size) for k in depth.shape[1:])
            chance = 0.5 * (1 + self._draws[:, 8, None, None]) * c.holes
            hole = torch.rand(len(depth), rows, columns, device=depth.device, generator=generator) < chance
            grown = functional.interpolate(hole[:, None].to(depth.dtype), scale_factor=c.hole_size, mode="nearest")
            missing = grown[:, 0, : depth.shape[1], : depth.shape[2]] > 0.5
            depth = depth.masked_fill(missing, self.camera.far if c.hole_reads == "far" else 0.0)
        return depth


def _small_turn(angles: Float[Tensor, "n 3"]) -> Float[Tensor, "n 3 3"]:
    """Rotations by small rotation vectors [rad]."""
    quaternion = torch.cat([torch.ones_like(angles[:, :1]), angles / 2], 1)
    return matrix_of(torch, quaternion / quaternion.norm(dim=1, keepdim=True))


_PATCH = 32
"""Side of the patches that become two triangles where they are level [cells]; five of them make a tile."""


def terrain_mesh(terrain: Terrain) -> tuple[Float[np.ndarray, "v 3"], Int[np.ndarray, "f 3"]]:
    """The ground as a camera sees it.

    Blocks and walls are the boxes themselves, with the vertical sides that MuJoCo C and a home have, and not the
    height field's slopes. Level ground is drawn coarsely: a terrain of 80 x 160 m has 13 million triangles otherwise.

    Returns:
        vertices (v, 3) float32 [m] and faces (f, 3) int32: the ground, then the blocks, then the tall boxes.
    """
    field = terrain.ground
    bare = np.where(field.labels == GROUND, field.heights, 0.0).astype(np.float32)  # boxes stand on level tiles
    ground = patch_mesh(bare, field.frame)
    return join_meshes(ground, box_mesh(terrain.blocks.boxes() + terrain.tall))


def patch_mesh(heights: Float[np.ndarray, "rows columns"], frame: GridFrame) -> tuple[np.ndarray, np.ndarray]:
    """A height field as triangles, level patches of 32 x 32 cells as two."""
    rows, columns = frame.shape
    parts = []
    for i in range(0, rows - 1, _PATCH):
        for j in range(0, columns - 1, _PATCH):
            patch = heights[i : i + _PATCH + 1, j : j + _PATCH + 1]
            x, y = frame.xy(np.array([i, j]))
            here = GridFrame(float(x), float(y), frame.resolution, patch.shape)
            if np.ptp(patch) > 0:
                parts.append(heightfield_mesh(patch, here))
                continue
            x1, y1 = here.xy(np.array(patch.shape) - 1)
            z = patch[0, 0]
            corners = np.array([[x, y, z], [x1, y, z], [x1, y1, z], [x, y1, z]], np.float32)
            parts.append((corners, np.array([[0, 1, 2], [0, 2, 3]], np.int32)))
    return join_meshes(*parts)
