"""The robots' depth cameras in stage 3, with the errors of real ones, and the ground as they see it."""

from __future__ import annotations

from typing import Any

import numpy as np
import torch
from jaxtyping import Float, Int, Shaped
from torch import Tensor

from vinl.robot.aliengo import CONTROL_DT
from vinl.robot.cameras import Camera
from vinl.robot.rotation import matrix_of
from vinl.sensing.depth import DepthCamera, Mesh
from vinl.sensing.preparation import settle_missing
from vinl.sensing.sensor import DepthSensor, mount_errors
from vinl.sensing.sensor_config import SensorConfig
from vinl.world.grid import GROUND, GridFrame
from vinl.world.mesh import box_mesh, heightfield_mesh, join_meshes
from vinl.world.terrain import Terrain

_LARGEST_KEY = 2**31 - 1


class TerrainCameras:
    """Depth images of all robots as their policy takes them, on the device; nothing waits for it.

    Everything random follows from the seed and the count of images, so that a resumed training sees the same.

    Args:
        config: errors of the cameras, drawn anew for every episode.
    """

    def __init__(self, mesh: Mesh, camera: Camera, config: SensorConfig, n: int, device: str, seed: int) -> None:
        self.camera = camera
        self._depth = DepthCamera([mesh], camera, device=device, dtype=torch.float16)
        self._device = self._depth.device
        self._sensor = DepthSensor(config, camera, n, self._device)
        self._rows = torch.arange(n, dtype=torch.int32, device=self._device)
        self._world = torch.zeros_like(self._rows)
        self._mount = torch.tensor(camera.position, dtype=torch.float32, device=self._device)
        self._turn = torch.tensor(camera.rotation(), dtype=torch.float32, device=self._device)
        self._generator = torch.Generator(self._device)
        self._seed, self._count = seed, 0
        self._past = torch.zeros(round(config.delay[1] / CONTROL_DT) + 1, n, 7, device=self._device)
        self._seen = False

    def look(self, pose: Float[Tensor, "n 7"], done: Shaped[Tensor, " n"] | None) -> Float[Tensor, "n height width"]:
        """What the robots see now.

        Args:
            pose: (n, 7) position [m] and quaternion of the trunks.
            done: (n,) not zero where an episode begins with this image; None: no time has passed since the last one.

        Returns:
            (n, H, W) float16 in [0, 1], pixels without a return dealt with as the camera's record says.
        """
        if done is not None:
            self._count += 1
            fresh = done.bool()
            self._past = torch.where(fresh[:, None], pose, torch.cat([pose[None], self._past[:-1]]))
            self._sensor.restart(self._keys(0), fresh)
        elif not self._seen:  # nobody has a past yet
            self._past = pose.expand_as(self._past).clone()
            self._sensor.restart(self._keys(0), torch.ones_like(self._rows, dtype=torch.bool))
        self._seen = True
        drawn = self._sensor.drawn
        then = self._past[self._delay(), self._rows.long()]
        trunk, (roll, pitch, height) = matrix_of(torch, then[:, 3:]), drawn["offset"].unbind(1)
        place = then[:, :3] + trunk @ self._mount
        place[:, 2] += height
        turn = trunk @ self._turn @ mount_errors(torch, roll, pitch)
        depth = self._depth.render_poses(self._world, place, turn)
        depth = self._sensor.spoil(depth, self._rows, self._keys(1), place, turn)
        return settle_missing(self.camera.missing, self.camera.normalise(depth), ~(depth > 0))

    @property
    def age(self) -> Float[Tensor, " n"]:
        """Of the images that ``look`` gives [s]."""
        return self._delay() * CONTROL_DT

    def _delay(self) -> Int[Tensor, " n"]:
        """In control steps."""
        return (self._sensor.drawn["delay"] / CONTROL_DT).round().long()

    def save_state(self) -> dict[str, Any]:
        """What ``load_state`` takes back."""
        drawn = {name: x.cpu() for name, x in self._sensor.drawn.items()}
        return {"past": self._past.cpu(), "drawn": drawn, "count": self._count}

    def load_state(self, state: dict[str, Any]) -> None:
        """See on as before.

        Raises:
            ValueError: the state is of cameras with another delay, or of another version.
        """
        if "drawn" not in state or state["past"].shape != self._past.shape:
            raise ValueError("it holds cameras with other errors")
        self._past = state["past"].to(self._device)
        for name, x in state["drawn"].items():
            self._sensor.drawn[name].copy_(x)
        self._count, self._seen = state["count"], True

    def _keys(self, purpose: int) -> Int[Tensor, " n"]:
        """Of the random numbers of each robot's camera (purpose 0) or image (1)."""
        seeded = self._generator.manual_seed(self._seed * 1_000_000_007 + 2 * self._count + purpose)
        return torch.randint(_LARGEST_KEY, self._rows.shape, dtype=torch.int32, device=self._device, generator=seeded)


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
