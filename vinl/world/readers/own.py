"""This package's own floor-plan format: a JSON object that a person can write. Described in docs/floorplans.md."""

from __future__ import annotations

from typing import Any

import numpy as np

from vinl.config.errors import InputError
from vinl.world.boxes import Boxes
from vinl.world.floorplan import FloorPlan, RoomLabel, assemble_floorplan
from vinl.world.readers.polygons import paint_inside, place_label
from vinl.world.readers.segments import Opening, Wall, raise_walls

SCHEMA = "vinl/floorplan/1"
"""What the entry ``schema`` of such a file says."""


def build_own_plan(entries: dict[str, Any], name: str, source: str) -> FloorPlan:
    """Build a floor plan from ``rooms``, ``walls``, ``doors``, ``windows`` and ``furniture``.

    Raises:
        InputError: if there is no room, a number is not finite, or there is no floor for the robot.
    """
    height = float(entries.get("height", 2.6))
    walls = [Wall(_point(w["from"]), _point(w["to"]), float(w["thickness"]), height) for w in entries["walls"]]
    openings = [Opening(_point(d["from"]), _point(d["to"]), float(d["height"])) for d in entries.get("doors", [])]
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
    windows = [_read_pane(pane) for pane in entries.get("windows", [])]
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


def _point(entry: Any) -> tuple[float, float]:
    x, y = entry
    return float(x), float(y)


def _read_thing(thing: dict[str, Any]) -> list[float]:
    (x, y), (length, width) = thing["at"], thing["size"]
    bottom, top = thing.get("span", [0.0, 0.75])
    return [float(v) for v in (x, y, np.deg2rad(thing.get("turn", 0.0)), length, width, bottom, top)]


def _read_pane(pane: dict[str, Any]) -> list[float]:
    (x0, y0), (x1, y1) = _point(pane["from"]), _point(pane["to"])
    yaw, length = np.arctan2(y1 - y0, x1 - x0), np.hypot(x1 - x0, y1 - y0)
    return [(x0 + x1) / 2, (y0 + y1) / 2, float(yaw), float(length), 0.08, *(float(v) for v in pane["span"])]
