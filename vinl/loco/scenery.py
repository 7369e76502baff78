"""What the student's camera sees of a training ground: the bare ground as triangles, blocks and walls as boxes."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float, Int

from vinl.world.grid import GridFrame
from vinl.world.heightfield import GROUND
from vinl.world.mesh import box_mesh, heightfield_mesh, join_meshes
from vinl.world.terrain import Terrain

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
