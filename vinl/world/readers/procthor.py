"""Houses in the format of AI2 ProcTHOR. Its plan is (x, z) with y up; here (x, y) with z up."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np

from vinl.config.errors import InputError
from vinl.world.boxes import Boxes
from vinl.world.floorplan import FloorPlan, RoomLabel, assemble_floorplan
from vinl.world.readers.segments import Opening, Wall, paint_inside, place_label, raise_walls

WALL_THICKNESS = 0.1
"""ProcTHOR's walls are planes; here they are this thick [m]."""

UNKNOWN_SIDE = 0.4
"""Side of the box that stands for an object whose size is not known [m]."""

FLAT = 0.03
"""Objects that rise less than this above the floor are walked over [m]: rugs."""

DOOR_HEIGHT = 2.1
"""Height of a doorway whose file does not state it [m]."""


def build_procthor_plan(house: dict[str, Any], name: str, source: str, sizes_file: Path) -> FloorPlan:
    """Build a floor plan from one house.

    Rooms' ``floorPolygon`` are the inside; walls become boxes along their lines; doors between rooms are open, doors to
    the outside stay shut. Objects are boxes turned by ``rotation.y``, of the size that ``sizes_file`` (a JSON object:
    asset id -> ``{"bbox": [x, y, z]}``) states; without it, or without an entry, cubes of 0.4 m. Raises ``InputError``
    if the sizes file is broken, or there is no floor for the robot.
    """
    polygons = [np.array([[p["x"], p["z"]] for p in room["floorPolygon"]], dtype=float) for room in house["rooms"]]
    if not polygons or not house["walls"]:
        raise InputError(f"{source}: the house has no rooms or no walls")
    walls = {str(wall["id"]): _read_wall(wall) for wall in house["walls"]}
    openings = [o for door in house.get("doors", []) if (o := _read_opening(door, walls)) is not None]
    frame, inside = paint_inside(polygons, walls.values(), source)
    boxes = Boxes(raise_walls(list(walls.values()), openings))
    furniture = Boxes(_read_objects(house.get("objects", []), _read_sizes(sizes_file)))
    labels = tuple(
        RoomLabel(str(room.get("roomType", "")), *place_label(polygon))
        for room, polygon in zip(house["rooms"], polygons, strict=True)
    )
    return assemble_floorplan(name, source, boxes, furniture, inside, frame, labels=labels)


def _read_wall(wall: dict[str, Any]) -> Wall:
    points = [(float(p["x"]), float(p["y"]), float(p["z"])) for p in wall["polygon"]]
    floor = min(y for _, y, _ in points)
    base = [(x, z) for x, y, z in points if y - floor < 1e-3]
    return Wall(base[0], base[-1], WALL_THICKNESS, max(max(y for _, y, _ in points), 0.5))


def _read_opening(door: dict[str, Any], walls: dict[str, Wall]) -> Opening | None:
    """The doorway on its wall's line; on ``wall1``, which runs the other way, it lies at length - x."""
    ids = [str(door.get(key, "")) for key in ("wall0", "wall1")]
    if any("exterior" in i for i in ids) or (door.get("room0") is not None and door.get("room0") == door.get("room1")):
        return None
    wall, mirrored = (walls[ids[0]], False) if ids[0] in walls else (walls.get(ids[1]), True)
    if wall is None:
        return None
    if "holePolygon" in door:
        xs, ys = [float(p["x"]) for p in door["holePolygon"]], [float(p["y"]) for p in door["holePolygon"]]
        low, high, top = min(xs), max(xs), max(ys)
    else:
        box = door["boundingBox"]
        low, high = sorted((float(box["min"]["x"]), float(box["max"]["x"])))
        top = float(box["max"].get("y", DOOR_HEIGHT))
    start, end = np.array(wall.start), np.array(wall.end)
    length = math.hypot(*(end - start))  # of any floats: their squares may be none
    if length < 1e-6:
        return None
    if mirrored:
        low, high = length - high, length - low
    along = (end - start) / length
    (x0, y0), (x1, y1) = start + along * low, start + along * high
    return Opening((float(x0), float(y0)), (float(x1), float(y1)), top)


def _read_objects(objects: list[dict[str, Any]], sizes: dict[str, Any]) -> np.ndarray:
    """Rows of boxes; what stands on other things (``children``) is left out."""
    rows = []
    for thing in objects:
        position = thing["position"]
        size = sizes.get(str(thing.get("assetId")), {}).get("bbox", [UNKNOWN_SIDE] * 3)
        length, height, width = (max(float(v), 0.01) for v in size)
        middle = float(position["y"])
        bottom, top = max(middle - height / 2, 0.0), middle + height / 2
        if top < FLAT:
            continue
        yaw = -np.deg2rad(float((thing.get("rotation") or {}).get("y", 0.0)))
        rows.append([float(position["x"]), float(position["z"]), yaw, length, width, bottom, max(top, bottom + 0.01)])
    return np.array(rows).reshape(-1, 7)


def _read_sizes(file: Path) -> dict[str, Any]:
    if not file.is_file():
        return {}
    try:
        sizes = json.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise InputError(f"{file}: the table of furniture sizes is broken ({error}); mend it or move it away") from None
    if not isinstance(sizes, dict):
        raise InputError(f"{file}: the table of furniture sizes must be a JSON object: asset id -> bbox")
    return sizes
