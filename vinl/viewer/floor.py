"""The floor of a plan as triangles and lines: only where the building is, unlike the rectangle that cameras see."""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Float, Int

from vinl.world.floorplan import FloorPlan

TILE = 0.5
"""Distance between the lines on the floor [m]."""


def list_runs(row: Bool[np.ndarray, " columns"]) -> list[tuple[int, int]]:
    """First and one past the last of each run of true cells."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], row, [False]]).astype(np.int8)))
    return [(int(a), int(b)) for a, b in edges.reshape(-1, 2)]


def cover_cells(cells: Bool[np.ndarray, "rows columns"]) -> Int[np.ndarray, "n 4"]:
    """Rectangles (first row, first column, rows end, columns end) that cover the true cells, none of them twice."""
    open_: dict[tuple[int, int], int] = {}
    found = []
    for i in range(len(cells) + 1):
        runs = set(list_runs(cells[i])) if i < len(cells) else set()
        ended = [run for run in open_ if run not in runs]
        found += [[open_.pop(run), run[0], i, run[1]] for run in ended]
        for run in runs:
            open_.setdefault(run, i)
    return np.array(sorted(found), int).reshape(-1, 4)


def inside_mesh(plan: FloorPlan) -> tuple[Float[np.ndarray, "v 3"], Int[np.ndarray, "f 3"]]:
    """The floor inside the building at z = 0, seen from above.

    Returns:
        vertices (v, 3) float32 [m] and faces (f, 3).
    """
    rectangles, half = cover_cells(plan.inside), plan.frame.resolution / 2
    low, high = plan.frame.xy(rectangles[:, :2]) - half, plan.frame.xy(rectangles[:, 2:]) - half
    corners = np.stack([low, np.stack([high[:, 0], low[:, 1]], 1), high, np.stack([low[:, 0], high[:, 1]], 1)], 1)
    vertices = np.concatenate([corners, np.zeros((len(corners), 4, 1))], 2).reshape(-1, 3)
    faces = np.arange(len(corners))[:, None, None] * 4 + np.array([[0, 1, 2], [0, 2, 3]])
    return vertices.astype(np.float32), faces.reshape(-1, 3)


def inside_lines(plan: FloorPlan, z: float = 0.003) -> Float[np.ndarray, "n 2 3"]:
    """Lines ``TILE`` apart over the floor inside the building [m]: by them one sees the robot move."""
    frame, half = plan.frame, plan.frame.resolution / 2
    x, y = frame.centres()
    every = round(TILE / frame.resolution)
    lines = []
    for i in range(0, len(y), every):
        lines += [[(x[a] - half, y[i], z), (x[b - 1] + half, y[i], z)] for a, b in list_runs(plan.inside[i])]
    for j in range(0, len(x), every):
        lines += [[(x[j], y[a] - half, z), (x[j], y[b - 1] + half, z)] for a, b in list_runs(plan.inside[:, j])]
    return np.array(lines, np.float32).reshape(-1, 2, 3)
