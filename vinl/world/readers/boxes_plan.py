"""Floor plans written by this package: boxes and the cells inside. Described in docs/floorplans.md."""

from __future__ import annotations

from typing import Any

import numpy as np

from vinl.config.errors import InputError
from vinl.world.boxes import Boxes
from vinl.world.floorplan import MAX_CELLS, FloorPlan, RoomLabel, assemble_floorplan
from vinl.world.grid import GridFrame

SCHEMA = "vinl/floorplan-boxes/1"
"""What the entry ``schema`` of such a file says."""


def build_boxes_plan(entries: dict[str, Any], name: str, source: str) -> FloorPlan:
    """Build a floor plan from what ``write_floorplan`` wrote.

    Raises:
        InputError: if a box or the grid makes no sense, or there is no floor for the robot.
    """
    grid = entries["grid"]
    frame = GridFrame(
        float(grid["x0"]), float(grid["y0"]), float(grid["resolution"]), (int(grid["rows"]), int(grid["columns"]))
    )
    rows, columns = frame.shape
    if not np.isfinite([frame.x0, frame.y0]).all() or not 0.002 <= frame.resolution <= 2.0:
        raise InputError(f"{source}: the grid needs a finite origin and a resolution between 0.002 m and 2 m")
    if min(rows, columns) < 1 or rows * columns > MAX_CELLS:
        raise InputError(f"{source}: the grid has {rows} x {columns} cells; between 1 and {MAX_CELLS} are possible")
    inside = np.zeros(frame.shape, dtype=bool)
    x, y = frame.centres()
    for x0, y0, x1, y1 in np.array(entries["inside"], dtype=float).reshape(-1, 4):
        columns_in, rows_in = np.searchsorted(x, [x0, x1]), np.searchsorted(y, [y0, y1])
        inside[slice(*rows_in), slice(*columns_in)] = True
    walls, furniture, windows = (_read(entries.get(key, [])) for key in ("walls", "furniture", "windows"))
    labels = tuple(
        RoomLabel(str(label["name"]), *(float(v) for v in label["at"])) for label in entries.get("labels", [])
    )
    return assemble_floorplan(str(entries.get("name", name)), source, walls, furniture, inside, frame, windows, labels)


def _read(rows: list[Any]) -> Boxes:
    table = np.array(rows, dtype=float)
    if rows and (table.ndim != 2 or table.shape[1] != 7):
        raise InputError("a box needs 7 numbers: x, y, yaw, length, width, bottom, top")
    return Boxes(table) if rows else Boxes.empty()
