"""Triangle meshes of boxes, floor plans and height fields: what cameras see and pictures show."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float, Int

from vinl.world.boxes import Blocks, Boxes
from vinl.world.floorplan import FloorPlan
from vinl.world.grid import GridFrame

_CORNERS = np.array([[i >> 2 & 1, i >> 1 & 1, i & 1] for i in range(8)], dtype=np.float64) - 0.5
# Corners of each face counter-clockwise as seen from outside; corner number = 4 * (+x) + 2 * (+y) + (+z).
_QUADS = np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]])
_TRIANGLES = np.concatenate([_QUADS[:, [0, 1, 2]], _QUADS[:, [0, 2, 3]]])

TRIANGLES_PER_BOX = len(_TRIANGLES)
"""``box_mesh`` gives every box this many faces, box after box."""

_BOTTOM, _TOP = (4, 10), (5, 11)
"""Which of them lie below and above."""

_ON_FLOOR = 0.01
"""A box lower than this stands on the floor [m]."""


def box_mesh(boxes: Boxes) -> tuple[Float[np.ndarray, "v 3"], Int[np.ndarray, "f 3"]]:
    """Twelve triangles a box, normals outward: vertices (8 n, 3) float32 [m] and faces (12 n, 3) int32, both box after
    box."""
    x, y, yaw, length, width, bottom, top = boxes.rows.T[..., None]
    u, v = _CORNERS[:, 0] * length, _CORNERS[:, 1] * width
    c, s = np.cos(yaw), np.sin(yaw)
    z = bottom + (_CORNERS[:, 2] + 0.5) * (top - bottom)
    vertices = np.stack([x + c * u - s * v, y + s * u + c * v, z], -1).reshape(-1, 3)
    faces = (np.arange(len(boxes))[:, None, None] * 8 + _TRIANGLES).reshape(-1, 3)
    return vertices.astype(np.float32), faces.astype(np.int32)


def seen_box_mesh(boxes: Boxes, highest: float) -> tuple[Float[np.ndarray, "v 3"], Int[np.ndarray, "f 3"]]:
    """``box_mesh`` without the faces that a camera below ``highest`` [m] never sees: bottoms on the floor, and tops
    above it. Fewer triangles make quicker rays."""
    vertices, faces = box_mesh(boxes)
    seen = np.ones((len(boxes), TRIANGLES_PER_BOX), bool)
    seen[:, _BOTTOM] = (boxes.rows[:, 5] >= _ON_FLOOR)[:, None]
    seen[:, _TOP] = (boxes.rows[:, 6] <= highest)[:, None]
    return vertices, np.ascontiguousarray(faces[seen.ravel()])


def floor_mesh(frame: GridFrame, z: float = 0.0, up: bool = True) -> tuple[np.ndarray, np.ndarray]:
    """A rectangle over the whole grid, cells' outer edges included, at a height ``z`` [m]. Its normal points up (a
    floor) or down (a ceiling)."""
    half = frame.resolution / 2
    x = frame.x0 - half, frame.x0 + frame.shape[1] * frame.resolution - half
    y = frame.y0 - half, frame.y0 + frame.shape[0] * frame.resolution - half
    vertices = np.array([[x[0], y[0], z], [x[1], y[0], z], [x[1], y[1], z], [x[0], y[1], z]], dtype=np.float32)
    faces = np.array([[0, 1, 2], [0, 2, 3]], dtype=np.int32)
    return vertices, faces if up else faces[:, ::-1].copy()


def join_meshes(*meshes: tuple[np.ndarray, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Several meshes as one: vertices and faces in the order of the arguments."""
    starts = np.cumsum([0] + [len(vertices) for vertices, _ in meshes[:-1]])
    faces = [faces + start for (_, faces), start in zip(meshes, starts, strict=True)]
    return (
        np.concatenate([vertices for vertices, _ in meshes]).astype(np.float32),
        np.concatenate(faces).astype(np.int32),
    )


def floorplan_mesh(
    plan: FloorPlan, blocks: Blocks | None = None, ceiling: float | None = None
) -> tuple[Float[np.ndarray, "v 3"], Int[np.ndarray, "f 3"]]:
    """Walls, furniture, blocks, floor and, at a height [m], a ceiling as one mesh, in this order, box after box."""
    boxes = plan.boxes if blocks is None else plan.boxes + blocks.boxes()
    parts = [box_mesh(boxes), floor_mesh(plan.frame)]
    if ceiling is not None:
        parts.append(floor_mesh(plan.frame, ceiling, up=False))
    return join_meshes(*parts)


def heightfield_mesh(
    heights: Float[np.ndarray, "rows columns"], frame: GridFrame
) -> tuple[Float[np.ndarray, "v 3"], Int[np.ndarray, "f 3"]]:
    """A height field [m] as triangles: one vertex in the middle of every cell, normals up, as MuJoCo draws it; vertices
    (rows * columns, 3) float32 [m] and faces (2 (rows - 1) (columns - 1), 3) int32. Raises ``ValueError`` if heights
    and frame differ in shape, or there are fewer than 2 x 2 cells."""
    rows, columns = frame.shape
    if heights.shape != (rows, columns):
        raise ValueError(f"heights have shape {heights.shape}, the frame {frame.shape}")
    if min(rows, columns) < 2:
        raise ValueError(f"a height field needs at least 2 x 2 cells, got {rows} x {columns}")
    x, y = np.meshgrid(*frame.centres())
    vertices = np.stack([x, y, heights], -1).reshape(-1, 3).astype(np.float32)
    a = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).reshape(-1)
    lower = np.stack([a, a + 1, a + columns + 1], -1)
    upper = np.stack([a, a + columns + 1, a + columns], -1)
    return vertices, np.stack([lower, upper], 1).reshape(-1, 3).astype(np.int32)
