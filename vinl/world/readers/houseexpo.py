"""Floor plans of HouseExpo: one closed outline in metres."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
from jaxtyping import Float

from vinl.config.errors import InputError
from vinl.world.boxes import FARTHEST, Boxes
from vinl.world.floorplan import FloorPlan, RoomLabel, assemble_floorplan, frame_around
from vinl.world.readers.segments import box_along, paint_polygon

WALL_THICKNESS = 0.08
"""Walls stand on the outline, this thick [m]. Between rooms the outline runs along both faces of the real wall."""

LARGEST = 150.0
"""A home wider than this is not in metres [m]."""


def is_houseexpo(entries: dict[str, Any]) -> bool:
    """Whether a JSON object is one of HouseExpo's."""
    return "verts" in entries or ("room_category" in entries and "walls" not in entries)


def build_houseexpo_plan(
    entries: dict[str, Any], name: str, source: str, scale: float | None, wall_height: float
) -> FloorPlan:
    """Build a floor plan from ``verts``, with room names from ``room_category``; ``scale`` is metres per unit, 1 if
    None. Raises ``InputError`` if the outline is missing, too short, crosses itself or is not in metres."""
    verts = entries.get("verts")
    if not isinstance(verts, list) or len(verts) < 3:
        found = "none" if not verts else f"{len(verts)} points" if isinstance(verts, list) else "something else"
        raise InputError(f"{source}: a HouseExpo file needs an outline 'verts' of 3 points or more; found {found}")
    points = np.array([[float(x), float(y)] for x, y in verts])
    if not np.isfinite(points).all():
        raise InputError(f"{source}: the outline has a coordinate that is not a number")
    points = np.clip(points, -FARTHEST, FARTHEST) * (scale or 1.0)  # what is cut is refused for its size below
    points = points[np.linalg.norm(points - np.roll(points, 1, axis=0), axis=1) > 1e-6]  # closed: first is last
    if len(points) < 3:
        raise InputError(f"{source}: the outline has fewer than 3 different points")
    low, high = points.min(0), points.max(0)
    if (high - low).max() > LARGEST:
        raise InputError(
            f"{source}: the outline is {high[0] - low[0]:.0f} x {high[1] - low[1]:.0f} m; HouseExpo is in metres; if "
            "this is in millimetres, give --resolution 0.001"
        )
    _check_box(entries.get("bbox"), (high - low) / (scale or 1.0), source)
    crossing = find_crossing(points)
    if crossing is not None:
        x, y = crossing
        raise InputError(f"{source}: the outline crosses itself at ({x:.2f}, {y:.2f}); the order of 'verts' is wrong")
    frame = frame_around(low, high, source)
    inside = paint_polygon(points, frame)
    sides = pairwise([(float(x), float(y)) for x, y in (*points, points[0])])
    # half a thickness beyond both ends fills the corners
    walls = Boxes(np.array([box_along(a, b, WALL_THICKNESS, 0.0, wall_height, WALL_THICKNESS / 2) for a, b in sides]))
    return assemble_floorplan(
        str(entries.get("id", name)), source, walls, Boxes.empty(), inside, frame, labels=_name(entries, scale or 1.0)
    )


def find_crossing(points: Float[np.ndarray, "k 2"]) -> tuple[float, float] | None:
    """Where two edges of a closed outline cross, if any do. Edges that only touch are let be: walls without
    thickness."""
    import shapely  # only here: generated homes do without

    edges = [shapely.LineString(pair) for pair in np.stack([points, np.roll(points, -1, axis=0)], 1)]
    for i, j in shapely.STRtree(edges).query(edges, predicate="crosses").T:
        at = edges[i].intersection(edges[j]).centroid
        if min(at.distance(shapely.Point(end)) for k in (i, j) for end in edges[k].coords) > 1e-6:
            return at.x, at.y
    return None


def _check_box(box: Any, size: np.ndarray, source: str) -> None:
    """The file's own bounding box tells whether its outline is the whole one."""
    if not isinstance(box, dict) or "min" not in box or "max" not in box:
        return
    stated = np.array(box["max"], dtype=float)[:2] - np.array(box["min"], dtype=float)[:2]
    if (np.abs(stated - size) > 0.3 * np.maximum(stated, size) + 1.0).any():
        raise InputError(
            f"{source}: 'verts' span {size[0]:.1f} x {size[1]:.1f}, but 'bbox' says {stated[0]:.1f} x {stated[1]:.1f}; "
            "the outline is not the whole one, or in other units"
        )


def _name(entries: dict[str, Any], scale: float) -> tuple[RoomLabel, ...]:
    labels = []
    for kind, boxes in (entries.get("room_category") or {}).items():
        for box in boxes:
            x0, y0, x1, y1 = (float(v) * scale for v in box[:4])
            labels.append(RoomLabel(str(kind), (x0 + x1) / 2, (y0 + y1) / 2))
    return tuple(labels)
