"""This package's own floor-plan formats: one that a person can write, one that it writes itself and reads again cell
for cell. Both are described in docs/floorplans.md."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from vinl.config.errors import InputError
from vinl.world.boxes import Boxes
from vinl.world.floorplan import MAX_CELLS, FloorPlan, RoomLabel, assemble_floorplan
from vinl.world.grid import GridFrame
from vinl.world.raster import split_rectangles
from vinl.world.readers.segments import Opening, Wall, box_along, paint_inside, place_label, raise_walls, read_point

SCHEMA = "vinl/floorplan/1"
"""What the entry ``schema`` of a file that a person wrote says."""

BOXES_SCHEMA = "vinl/floorplan-boxes/1"
"""And of one that this package wrote: boxes, and the cells inside."""


def build_own_plan(entries: dict[str, Any], name: str, source: str) -> FloorPlan:
    """Build a floor plan from ``rooms``, ``walls``, ``doors``, ``windows`` and ``furniture``. Raises ``InputError`` if
    there is no room, a number is not finite, or there is no floor for the robot."""
    height = float(entries.get("height", 2.6))
    walls = [Wall(read_point(w["from"]), read_point(w["to"]), float(w["thickness"]), height) for w in entries["walls"]]
    openings = [
        Opening(read_point(d["from"]), read_point(d["to"]), float(d["height"])) for d in entries.get("doors", [])
    ]
    polygons = [np.array(room["outline"], dtype=float).reshape(-1, 2) for room in entries["rooms"]]
    if not polygons or not walls:
        raise InputError(f"{source}: the plan has no rooms or no walls")
    frame, inside = paint_inside(polygons, walls, source)
    # doorways lie in the walls, between the rooms' outlines, and belong to the inside
    boxes = Boxes(raise_walls(walls, openings))
    labels = tuple(
        RoomLabel(str(room["name"]), *place_label(polygon))
        for room, polygon in zip(entries["rooms"], polygons, strict=True)
    )
    furniture = Boxes(np.array([_read_thing(thing) for thing in entries.get("furniture", [])]).reshape(-1, 7))
    windows = [
        box_along(read_point(pane["from"]), read_point(pane["to"]), 0.08, *(float(v) for v in pane["span"]))
        for pane in entries.get("windows", [])
    ]
    return assemble_floorplan(
        str(entries.get("name", name)),
        source,
        boxes,
        furniture,
        inside,
        frame,
        Boxes(np.array(windows).reshape(-1, 7)),
        labels,
    )


def _read_thing(thing: dict[str, Any]) -> list[float]:
    (x, y), (length, width) = thing["at"], thing["size"]
    bottom, top = thing.get("span", [0.0, 0.75])
    return [float(v) for v in (x, y, np.deg2rad(thing.get("turn", 0.0)), length, width, bottom, top)]


def build_boxes_plan(entries: dict[str, Any], name: str, source: str) -> FloorPlan:
    """Build a floor plan from what ``write_floorplan`` wrote. Raises ``InputError`` if a box or the grid makes no
    sense, or there is no floor for the robot."""
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
    walls, furniture, windows = (_read_boxes(entries.get(key, [])) for key in ("walls", "furniture", "windows"))
    labels = tuple(
        RoomLabel(str(label["name"]), *(float(v) for v in label["at"])) for label in entries.get("labels", [])
    )
    return assemble_floorplan(str(entries.get("name", name)), source, walls, furniture, inside, frame, windows, labels)


def _read_boxes(rows: list[Any]) -> Boxes:
    table = np.array(rows, dtype=float)
    if rows and (table.ndim != 2 or table.shape[1] != 7):
        raise InputError("a box needs 7 numbers: x, y, yaw, length, width, bottom, top")
    return Boxes(table) if rows else Boxes.empty()


def write_floorplan(plan: FloorPlan, file: str | Path) -> Path:
    """Write any floor plan as JSON (schema ``vinl/floorplan-boxes/1``, described in docs/floorplans.md) to a name that
    ends in ``.json``; folders are made as needed. Raises ``InputError`` if the name has another ending or the file
    cannot be written."""
    file = Path(file)
    if file.suffix.lower() != ".json":
        raise InputError(f"{file}: give a name that ends in .json")
    frame = plan.frame
    edges = split_rectangles(plan.inside)[:, [1, 0, 3, 2]] - 0.5
    inside = np.array([frame.x0, frame.y0] * 2) + edges * frame.resolution
    grid = {"x0": frame.x0, "y0": frame.y0, "resolution": frame.resolution}
    grid |= {"rows": frame.shape[0], "columns": frame.shape[1]}
    lists = {
        "inside": [[round(float(v), 6) for v in row] for row in inside],
        "walls": plan.walls.rows.tolist(),
        "furniture": plan.furniture.rows.tolist(),
        "windows": plan.windows.rows.tolist(),
        "labels": [{"name": label.name, "at": [label.x, label.y]} for label in plan.labels],
    }
    parts = [f'  "schema": "{BOXES_SCHEMA}"', f'  "name": {json.dumps(plan.name)}', f'  "grid": {json.dumps(grid)}']
    for key, entries in lists.items():
        lines = ",\n".join("    " + json.dumps(entry) for entry in entries)
        parts.append(f'  "{key}": [\n{lines}\n  ]' if entries else f'  "{key}": []')
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text("{\n" + ",\n".join(parts) + "\n}\n", encoding="utf-8")
    except OSError as error:
        raise InputError(f"{file}: cannot be written ({error.strerror}); choose another place") from None
    return file
