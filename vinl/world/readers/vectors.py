"""Floor plans as vectors in pixels: the format of Raster2Vec."""

from __future__ import annotations

from typing import Any

import numpy as np

from vinl.config.errors import InputError
from vinl.world.boxes import FARTHEST, Boxes
from vinl.world.floorplan import FloorPlan, RoomLabel, assemble_floorplan, frame_around
from vinl.world.grid import GridFrame
from vinl.world.raster import find_inside, label_regions, paint_boxes
from vinl.world.readers.segments import Opening, Wall, box_along, raise_walls, read_point

WALL_THICKNESS = 0.12
"""The file's walls are lines; here they are this thick [m]."""

DOOR_HEIGHT = 2.0
"""Height of the doorways [m]; the file knows none."""

BESIDE = 0.2
"""So far from a door's line both sides are looked at: a door with the outside on one of them is a window [m]."""

CLOSED = 0.6
"""If the walls enclose less than this fraction of what they enclose once gaps as wide as doors are closed, they have
such gaps."""

TOPS = {"cooking_counter": 0.9, "washing_basin": 0.85, "bathtub": 0.55, "toilet": 0.8, "stairs": 1.0}
"""Height of what stands where an icon is [m]. ``entrance`` and ``special`` are marks on the floor."""


def is_vector_plan(entries: dict[str, Any]) -> bool:
    """Whether an entry ``walls`` holds lines as four numbers, and not objects."""
    walls = entries.get("walls")
    return isinstance(walls, list) and bool(walls) and isinstance(walls[0], list)


def build_vector_plan(
    entries: dict[str, Any], name: str, source: str, metres_per_pixel: float | None, wall_height: float
) -> FloorPlan:
    """Build a floor plan from ``walls``, ``doors``, ``icons`` and ``rooms`` in pixels, y down; ``metres_per_pixel``
    goes before the file's own ``m_per_px_est``.

    A door with the outside on one side is a window or the front door and stays closed. Of a sheet with several storeys,
    which are parts that do not touch, the one with the most floor is kept. Raises ``InputError`` if the scale is
    missing or out of reason, or there is no floor for the robot.
    """
    scale = metres_per_pixel or entries.get("m_per_px_est")
    if not isinstance(scale, int | float) or not 1e-4 <= scale <= 1.0:
        raise InputError(f"{source}: the scale m_per_px_est is {scale}; give metres per pixel with --resolution")
    lines = _to_metres(entries["walls"], scale)
    doors = _to_metres(entries.get("doors", []), scale)
    walls = [Wall(read_point(line[:2]), read_point(line[2:]), WALL_THICKNESS, wall_height) for line in lines]
    ends = lines.reshape(-1, 2)
    frame = frame_around(ends.min(0) - WALL_THICKNESS, ends.max(0) + WALL_THICKNESS, source)
    shut = paint_boxes(Boxes(raise_walls(walls, [])), frame)
    inside = _find_enclosed(shut, frame)
    storeys = label_regions(shut | inside, corners=True)
    sizes = np.bincount(storeys[inside], minlength=2)
    if not inside.any():
        raise InputError(f"{source}: the walls enclose no floor; is the outline closed?")
    storey = storeys == sizes[1:].argmax() + 1
    ways = [door for door in doors if _leads_inside(door, inside & storey, frame)]
    openings = [Opening(read_point(door[:2]), read_point(door[2:]), DOOR_HEIGHT) for door in ways]
    boxes = Boxes(raise_walls(walls, openings))
    if openings:  # the floor of a doorway belongs to the inside
        inside |= paint_boxes(
            Boxes(np.array([box_along(o.start, o.end, WALL_THICKNESS + 0.1, 0.0, 1.0) for o in openings])), frame
        )
    kept = _touch(boxes, storey, frame)
    icons = [entry for entry in entries.get("icons", []) if entry[4] in TOPS]
    places = _to_metres([entry[:4] for entry in icons], scale)
    furniture = Boxes(
        np.array([_stand(place, TOPS[entry[4]]) for place, entry in zip(places, icons, strict=True)]).reshape(-1, 7)
    )
    rooms = [entry for entry in entries.get("rooms", []) if entry[4] != "point"]
    centres = _to_metres([entry[:4] for entry in rooms], scale).reshape(-1, 2, 2).mean(1)
    labels = tuple(
        RoomLabel(str(entry[4]), float(x), float(y))
        for (x, y), entry in zip(centres, rooms, strict=True)
        if storey[tuple(frame.cell(np.array([x, y])))]
    )
    return assemble_floorplan(
        name,
        source,
        Boxes(boxes.rows[kept]),
        Boxes(furniture.rows[_touch(furniture, storey, frame)]),
        inside & storey,
        frame,
        labels=labels,
    )


def _find_enclosed(shut: np.ndarray, frame: GridFrame) -> np.ndarray:
    """Floor that closed walls keep from the grid's edge; where they have gaps, what a wide disc cannot roll into."""
    outside = label_regions(np.pad(~shut, 1, constant_values=True))[1:-1, 1:-1] == 1
    inside = ~shut & ~outside
    rolled = find_inside(shut, frame.resolution)
    return inside if inside.sum() >= CLOSED * rolled.sum() else rolled


def _to_metres(entries: list[Any], scale: float) -> np.ndarray:
    """Rows x1, y1, x2, y2 in pixels with y down to metres with y up; shape (n, 4)."""
    rows = np.array([[float(v) for v in entry[:4]] for entry in entries]).reshape(-1, 4)
    if not np.isfinite(rows).all():
        raise InputError("a wall, door or icon has a coordinate that is not a number")
    if (np.abs(rows) > FARTHEST / scale).any():
        raise InputError(f"a wall, door or icon has a coordinate beyond {FARTHEST:g} m")
    return rows * scale * np.array([1.0, -1.0, 1.0, -1.0])


def _leads_inside(door: np.ndarray, inside: np.ndarray, frame: GridFrame) -> bool:
    """Whether both sides of most of a door are floor of the building."""
    start, end = door[:2], door[2:]
    length = float(np.linalg.norm(end - start))
    if length < 0.3:
        return False
    across = np.array([start[1] - end[1], end[0] - start[0]]) / length
    middle = start + (end - start) * np.linspace(0.2, 0.8, 7)[:, None]
    cells = frame.cell(np.stack([middle + across * BESIDE, middle - across * BESIDE]))
    return bool((inside[cells[..., 0], cells[..., 1]].mean(1) > 0.5).all())


def _stand(place: np.ndarray, top: float) -> list[float]:
    low, high = np.minimum(place[:2], place[2:]), np.maximum(place[:2], place[2:])
    size = np.maximum(high - low, 0.05)
    return [*((low + high) / 2).tolist(), 0.0, *size.tolist(), 0.0, top]


def _touch(boxes: Boxes, storey: np.ndarray, frame: GridFrame) -> np.ndarray:
    """Which boxes have their middle on the storey."""
    cells = frame.cell(boxes.rows[:, :2])
    return storey[cells[:, 0], cells[:, 1]]
