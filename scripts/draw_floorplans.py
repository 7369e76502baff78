"""Draw the five evaluation homes: writes assets/floorplans/*.json and docs/images/floorplans/*.png.

    python scripts/draw_floorplans.py

Rooms are outlines on the middle lines of their walls; walls follow from them (an edge of one room is an outer wall, an
edge of two an inner one). Furniture is pushed off the walls that it would stand in.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import shapely
import shapely.affinity
from shapely.ops import linemerge, unary_union

from vinl.world.drawing import save_floorplan
from vinl.world.floorplan import FloorPlan
from vinl.world.free_space import FreeSpace
from vinl.world.readers import load_floorplan
from vinl.world.readers.own import SCHEMA
from vinl.world.start_goal import sample_start_goals

ROOT = Path(__file__).resolve().parent.parent
PLANS, PICTURES = ROOT / "assets" / "floorplans", ROOT / "docs" / "images" / "floorplans"

FACING = {"N": 90.0, "W": 180.0, "S": 270.0, "E": 0.0}

Part = tuple[float, float, float, float, float]
"""One box of a piece of furniture in its own frame: ahead of the wall from, to; across from, to; top [m]."""


def chair(width: float = 0.42, depth: float = 0.44) -> list[Part]:
    h = width / 2
    return [(0.0, depth, -h, h, 0.45), (0.0, 0.05, -h, h, 0.88)]


def armchair() -> list[Part]:
    return [
        (0.0, 0.8, -0.4, 0.4, 0.42),
        (0.0, 0.2, -0.4, 0.4, 0.85),
        (0.2, 0.8, -0.4, -0.26, 0.6),
        (0.2, 0.8, 0.26, 0.4, 0.6),
    ]


def sofa(width: float = 2.0, depth: float = 0.88) -> list[Part]:
    h, third = width / 2, (width - 0.32) / 2
    return [
        (0.22, depth, -h + 0.16, -h + 0.16 + third, 0.43),
        (0.22, depth, h - 0.16 - third, h - 0.16, 0.43),
        (0.0, 0.22, -h, h, 0.8),
        (0.22, depth, -h, -h + 0.16, 0.6),
        (0.22, depth, h - 0.16, h, 0.6),
    ]


def bed(width: float = 1.6, length: float = 2.05, tables: bool = True) -> list[Part]:
    h = width / 2
    parts = [(0.05, length, -h, h, 0.5), (0.0, 0.05, -h, h, 0.95)]
    pillows = [(-h + 0.08, -0.04), (0.04, h - 0.08)] if width > 1.2 else [(-h + 0.1, h - 0.1)]
    parts += [(0.1, 0.5, low, high, 0.6) for low, high in pillows]
    if tables:
        parts += [(0.0, 0.4, -h - 0.47, -h - 0.05, 0.5), (0.0, 0.4, h + 0.05, h + 0.47, 0.5)]
    return parts


def chest(width: float, depth: float = 0.45, top: float = 0.8) -> list[Part]:
    return [(0.0, depth, -width / 2, width / 2, top)]


def wardrobe(width: float = 2.0, depth: float = 0.6) -> list[Part]:
    n = max(round(width / 0.55), 1)
    edges = np.linspace(-width / 2, width / 2, n + 1)
    return [(0.0, depth, float(a), float(b), 2.2) for a, b in pairwise(edges)]


def desk(width: float = 1.4, depth: float = 0.7) -> list[Part]:
    out = [(a + depth - 0.1, b + depth - 0.1, c, d, top) for a, b, c, d, top in _turned_chair()]
    return [(0.0, depth, -width / 2, width / 2, 0.75), *out]


def _turned_chair() -> list[Part]:
    return [(0.0, 0.44, -0.22, 0.22, 0.45), (0.39, 0.44, -0.22, 0.22, 0.9)]


def toilet() -> list[Part]:
    return [(0.0, 0.18, -0.19, 0.19, 0.8), (0.18, 0.68, -0.18, 0.18, 0.42)]


def basin(width: float = 0.6) -> list[Part]:
    return [(0.0, 0.46, -width / 2, width / 2, 0.85)]


def bath(length: float = 1.7, depth: float = 0.75) -> list[Part]:
    return [(0.0, depth, -length / 2, length / 2, 0.56)]


def shower(side: float = 0.9) -> list[Part]:
    return [(0.0, side, -side / 2, side / 2, 0.65)]


def kitchen(width: float, fridge: str = "") -> list[Part]:
    """A run of units 0.6 m deep; ``fridge`` at the "L"eft or "R"ight end as seen from the room."""
    h, parts = width / 2, []
    low, high = -h, h
    if fridge == "L":
        parts.append((0.0, 0.64, h - 0.62, h, 1.85))
        high = h - 0.62
    if fridge == "R":
        parts.append((0.0, 0.64, -h, -h + 0.62, 1.85))
        low = -h + 0.62
    edges = np.linspace(low, high, max(round((high - low) / 0.6), 1) + 1)
    return parts + [(0.0, 0.6, float(a), float(b), 0.9) for a, b in pairwise(edges)]


def table(length: float, width: float, ends: bool = False, top: float = 0.75) -> list[Part]:
    """A dining table, centred, its long side across, with chairs pushed half under it."""
    parts: list[Part] = [(-width / 2, width / 2, -length / 2, length / 2, top)]
    n = max(int(length / 0.65), 1)
    for k in range(n):
        middle = (k + 0.5) / n * length - length / 2
        for side in (1, -1):
            seat = sorted((side * (width / 2 - 0.14), side * (width / 2 + 0.28)))
            back = sorted((side * (width / 2 + 0.24), side * (width / 2 + 0.29)))
            parts.append((seat[0], seat[1], middle - 0.2, middle + 0.2, 0.45))
            parts.append((back[0], back[1], middle - 0.2, middle + 0.2, 0.88))
    if ends:
        for side in (1, -1):
            seat = sorted((side * (length / 2 - 0.14), side * (length / 2 + 0.28)))
            parts.append((-0.2, 0.2, seat[0], seat[1], 0.45))
    return parts


def slab(length: float, width: float, top: float) -> list[Part]:
    """A plain box, centred, its long side across."""
    return [(-width / 2, width / 2, -length / 2, length / 2, top)]


@dataclass
class Home:
    """A home while it is drawn."""

    name: str
    about: str
    rooms: dict[str, list[tuple[float, float]]]
    outer: float = 0.3
    inner: float = 0.12
    height: float = 2.6
    open_lines: list[tuple[float, float, float, float]] = field(default_factory=list)
    stubs: list[tuple[float, float, float, float]] = field(default_factory=list)
    doors: list[dict] = field(default_factory=list)
    windows: list[dict] = field(default_factory=list)
    furniture: list[dict] = field(default_factory=list)
    walls: list[dict] = field(default_factory=list)
    taken: list[tuple[str, shapely.Geometry]] = field(default_factory=list)

    def raise_walls(self) -> None:
        """Walls from the rooms' outlines, less the open lines, plus the free-standing stubs."""
        outlines = {name: shapely.Polygon(points) for name, points in self.rooms.items()}
        shell = unary_union([outline.buffer(1e-4, join_style="mitre") for outline in outlines.values()])
        assert isinstance(shell, shapely.Polygon), "the rooms must hang together"
        rim = shell.exterior.buffer(0.01)
        edges = unary_union([outline.exterior for outline in outlines.values()])
        # without the lines that stay open
        gone = unary_union([shapely.LineString([line[:2], line[2:]]).buffer(0.005) for line in self.open_lines])
        inside: Any = edges.difference(rim).difference(gone)
        corners = list(shell.exterior.simplify(0.005).coords)[:-1]
        for k, corner in enumerate(corners):
            before, after = corners[k - 1], corners[(k + 1) % len(corners)]
            beyond = corners[(k + 2) % len(corners)]
            a = _shift_end(after, corner, before, self.outer / 2)
            b = _shift_end(corner, after, beyond, self.outer / 2)
            self.walls.append({"from": _round(a), "to": _round(b), "thickness": self.outer})
        merged = linemerge(inside) if inside.geom_type == "MultiLineString" else inside
        for line in getattr(merged, "geoms", [merged]):
            for a, b in pairwise(list(line.simplify(0.005).coords)):
                self.walls.append({"from": _round(a), "to": _round(b), "thickness": self.inner})
        for x0, y0, x1, y1 in self.stubs:
            self.walls.append({"from": [x0, y0], "to": [x1, y1], "thickness": self.inner})

    def door(self, x: float, y: float, along: str = "x", width: float = 0.95, height: float = 2.1) -> None:
        """An open doorway around a point on a wall that runs along x or along y."""
        half = np.array([width / 2, 0.0]) if along == "x" else np.array([0.0, width / 2])
        at = np.array([x, y])
        self.doors.append({"from": _round(at - half), "to": _round(at + half), "height": height})

    def window(
        self, x: float, y: float, along: str = "x", width: float = 1.5, span: tuple[float, float] = (0.9, 2.2)
    ) -> None:
        """A pane; a span from the floor on is a glazed or a shut front door."""
        half = np.array([width / 2, 0.0]) if along == "x" else np.array([0.0, width / 2])
        at = np.array([x, y])
        self.windows.append({"from": _round(at - half), "to": _round(at + half), "span": list(span)})

    def put(self, name: str, parts: list[Part], x: float, y: float, facing: str | float) -> None:
        """Put furniture with the middle of its back at a point, looking along ``facing``, off the walls."""
        angle = FACING[facing] if isinstance(facing, str) else facing
        c, s = np.cos(np.deg2rad(angle)), np.sin(np.deg2rad(angle))
        boxes = []
        for a, b, left, right, top in parts:
            u, v = (a + b) / 2, (left + right) / 2
            boxes.append((x + c * u - s * v, y + s * u + c * v, b - a, right - left, top))
        shapes = unary_union([_rectangle(bx, by, depth, width, angle) for bx, by, depth, width, _ in boxes])
        shift = self._find_shift(shapes)
        moved = shapely.affinity.translate(shapes, *shift)
        for other, shape in self.taken:
            if shapely.area(shapely.intersection(shape, moved)) > 1e-3:
                print(f"{self.name}: {name} at ({x}, {y}) stands in the {other}")
        self.taken.append((name, moved))
        for bx, by, depth, width, top in boxes:
            at = _round((bx + shift[0], by + shift[1]))
            piece = {"name": name, "at": at, "size": _round((depth, width)), "span": [0.0, round(top, 3)]}
            self.furniture.append(piece if angle == 0 else {**piece, "turn": angle})

    def _find_shift(self, shapes) -> tuple[float, float]:
        """The smallest move that takes the piece out of the walls."""
        solid = unary_union(
            [
                shapely.LineString([w["from"], w["to"]]).buffer(w["thickness"] / 2 + 0.005, cap_style="square")
                for w in self.walls
            ]
        )
        near = np.arange(-0.44, 0.441, 0.02)
        for dx, dy in sorted(((a, b) for a in near for b in near), key=lambda d: (np.hypot(*d).round(6), d)):
            moved = shapely.affinity.translate(shapes, dx, dy)
            if moved.intersection(solid).area < 1e-6:
                return float(dx), float(dy)
        raise SystemExit(f"{self.name}: a piece of furniture at {shapes.centroid} stands in a wall")

    def write(self) -> Path:
        """Write the plan's file, one entry a line."""
        parts = [f'  "schema": "{SCHEMA}"', f'  "name": "{self.name}"', f'  "about": {json.dumps(self.about)}']
        parts.append(f'  "height": {self.height}')
        rooms = [{"name": name, "outline": [_round(p) for p in points]} for name, points in self.rooms.items()]
        lists = {"rooms": rooms, "walls": self.walls, "doors": self.doors}
        lists |= {"windows": self.windows, "furniture": self.furniture}
        for key, entries in lists.items():
            lines = ",\n".join("    " + json.dumps(entry) for entry in entries)
            parts.append(f'  "{key}": [\n{lines}\n  ]')
        path = PLANS / f"{self.name}.json"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("{\n" + ",\n".join(parts) + "\n}\n", encoding="utf-8")
        return path


def _round(values) -> list[float]:
    return [round(float(v), 3) + 0.0 for v in values]


def _shift_end(start, end, then, half: float) -> np.ndarray:
    """Where a wall must end to meet the next one in a mitre [m].

    Readers lengthen walls by half their thickness, which fills a square corner; at an obtuse one the box would stand
    out, so that it ends earlier.
    """
    along, onward = (np.subtract(b, a) / np.linalg.norm(np.subtract(b, a)) for a, b in ((start, end), (end, then)))
    turn = np.arccos(np.clip(along @ onward, -1.0, 1.0))
    return np.asarray(end) + along * min(half * np.tan(turn / 2) - half, 0.0)


def _rectangle(x: float, y: float, depth: float, width: float, angle: float):
    shape = shapely.box(x - depth / 2, y - width / 2, x + depth / 2, y + width / 2)
    return shapely.affinity.rotate(shape, angle, origin=(x, y))


def box(x0: float, y0: float, x1: float, y1: float) -> list[tuple[float, float]]:
    return [(x0, y0), (x1, y0), (x1, y1), (x0, y1)]


def draw_harbour_flat() -> Home:
    """A flat of the 1930s: rooms on both sides of a long corridor."""
    home = Home(
        "harbour_flat",
        "corridor flat: six rooms on both sides of a passage 13 m long",
        {
            "living": box(0, 0, 5.0, 3.9),
            "kitchen": box(5.0, 0, 8.6, 3.9),
            "study": box(8.6, 0, 13.0, 3.9),
            "corridor": box(0, 3.9, 13.0, 5.5),
            "bedroom": box(0, 5.5, 4.4, 9.2),
            "bath": box(4.4, 5.5, 7.0, 9.2),
            "store": box(7.0, 5.5, 8.6, 9.2),
            "children": box(8.6, 5.5, 13.0, 9.2),
        },
    )
    home.raise_walls()
    for x, y in ((4.1, 3.9), (6.0, 3.9), (9.5, 3.9), (3.5, 5.5), (5.1, 5.5), (7.8, 5.5), (9.4, 5.5)):
        home.door(x, y)
    for x in (1.3, 3.7, 6.8, 10.8):
        home.window(x, 0)
    for x in (2.2, 5.7, 10.8):
        home.window(x, 9.2, width=1.0 if x == 5.7 else 1.6)
    home.window(13.0, 4.7, "y", 1.0, (0.0, 2.1))
    home.window(0, 4.7, "y", 0.9)
    home.put("sofa", sofa(2.2), 0, 1.9, "E")
    home.put("coffee table", slab(1.1, 0.55, 0.42), 1.75, 1.9, "E")
    home.put("armchair", armchair(), 1.7, 0.15, 90.0)
    home.put("television", chest(1.6, 0.4, 0.5), 5.0, 1.7, "W")
    home.put("shelf", chest(1.8, 0.32, 2.0), 1.4, 3.9, "S")
    home.put("kitchen", kitchen(3.4, "R"), 8.6, 1.8, "W")
    home.put("table", table(1.2, 0.8), 6.15, 1.45, "E")
    home.put("desk", desk(1.6), 11.3, 0, "N")
    home.put("shelf", chest(2.4, 0.35, 2.1), 13.0, 2.0, "W")
    home.put("day bed", bed(0.9, 2.0, False), 9.2, 0, "N")
    home.put("bed", bed(1.6), 0, 7.6, "E")
    home.put("wardrobe", wardrobe(2.0), 4.4, 7.9, "W")
    home.put("chest", chest(1.0), 1.4, 5.5, "N")
    home.put("bath", bath(1.7), 7.0, 8.2, "W")
    home.put("basin", basin(), 7.0, 6.5, "W")
    home.put("toilet", toilet(), 4.4, 8.6, "E")
    home.put("shelves", chest(1.4, 0.4, 2.0), 7.8, 9.2, "S")
    home.put("bed", bed(0.9, 2.0, False), 13.0, 6.2, "W")
    home.put("bed", bed(0.9, 2.0, False), 13.0, 8.6, "W")
    home.put("desk", desk(1.2, 0.6), 9.9, 9.2, "S")
    home.put("wardrobe", wardrobe(1.2), 8.6, 7.4, "E")
    home.put("shoe rack", chest(1.1, 0.28, 0.9), 11.4, 5.5, "S")
    home.put("console", chest(0.9, 0.28, 0.85), 1.4, 3.9, "N")
    return home


def draw_mill_loft() -> Home:
    """One hall with columns; only the bath has walls to the ceiling."""
    home = Home(
        "mill_loft",
        "open-plan loft in a mill: one hall with columns, a bath in a box, a sleeping corner behind a wall of shelves",
        {
            "hall": [(0, 0), (12.6, 0), (12.6, 8.8), (7.4, 8.8), (7.4, 6.2), (4.2, 6.2), (4.2, 8.8), (0, 8.8)],
            "bath": box(4.2, 6.2, 7.4, 8.8),
        },
        outer=0.45,
        height=3.6,
    )
    home.stubs = [(4.2, 3.9, 4.2, 4.6)]
    home.raise_walls()
    home.door(6.6, 6.2)
    for x in (1.8, 4.4, 7.0, 9.6, 11.6):
        home.window(x, 0, width=1.7, span=(0.6, 3.0))
    home.window(12.6, 2.2, "y", 1.8, (0.6, 3.0))
    home.window(0, 6.6, "y", 1.8, (0.6, 3.0))
    home.window(9.0, 8.8, "x", 1.1, (0.0, 2.2))
    for x in (4.4, 8.4):
        for y in (2.9,):
            home.put("column", slab(0.35, 0.35, 3.6), x, y, "E")
    home.put("bed", bed(1.8), 0, 6.5, "E")
    home.put("shelf wall", chest(2.9, 0.4, 2.0), 1.7, 4.15, "N")
    home.put("wardrobe", wardrobe(1.9), 3.1, 8.8, "S")
    home.put("chest", chest(1.2, 0.45, 0.9), 4.2, 6.9, "W")
    home.put("sofa", sofa(2.4), 6.28, 3.55, "S")
    home.put("sofa", sofa(1.7), 4.75, 1.75, "E")
    home.put("coffee table", slab(1.2, 0.7, 0.38), 6.8, 1.75, 90.0)
    home.put("television", chest(2.0, 0.4, 0.5), 6.7, 0, "N")
    home.put("desk", desk(1.8, 0.8), 1.9, 0, "N")
    home.put("bookcase", chest(2.2, 0.35, 2.1), 0, 2.4, "E")
    home.put("kitchen", kitchen(3.8, "L"), 12.6, 6.2, "W")
    home.put("island", slab(2.2, 0.9, 0.92), 10.3, 6.3, "E")
    for y in (5.7, 6.3, 6.9):
        home.put("stool", slab(0.36, 0.36, 0.65), 9.6, y, "E")
    home.put("dining table", table(2.2, 0.95, True), 10.2, 2.45, "E")
    home.put("coats", chest(1.0, 0.4, 1.9), 7.4, 7.6, "E")
    home.put("bath", bath(1.8, 0.8), 5.6, 8.8, "S")
    home.put("toilet", toilet(), 7.4, 8.2, "W")
    home.put("basin", basin(1.0), 4.2, 7.0, "E")
    home.put("plant", slab(0.45, 0.45, 1.4), 12.1, 0.6, "E")
    home.put("plant", slab(0.4, 0.4, 1.2), 0.6, 8.3, "E")
    return home


def draw_garden_bungalow() -> Home:
    """An L around a garden: living in one wing, sleeping in the other."""
    home = Home(
        "garden_bungalow",
        "L-shaped bungalow: living wing and sleeping wing meet at the hall",
        {
            "living": box(6.6, 0, 12.0, 5.4),
            "kitchen": box(12.0, 0, 15.4, 5.4),
            "hall": [(4.6, 0), (6.6, 0), (6.6, 5.4), (5.7, 5.4), (5.7, 12.4), (4.2, 12.4), (4.2, 5.4), (4.6, 5.4)],
            "guest": box(0, 0, 4.6, 2.9),
            "bath": [(0, 2.9), (4.6, 2.9), (4.6, 5.4), (0, 5.4)],
            "bedroom": box(0, 5.4, 4.2, 9.3),
            "child": box(0, 9.3, 4.2, 12.4),
        },
    )
    home.open_lines = [(12.0, 2.2, 12.0, 4.9)]
    home.raise_walls()
    home.door(6.6, 3.4, "y", 1.3)
    home.door(4.6, 1.9, "y")
    home.door(4.6, 4.2, "y")
    home.door(4.2, 6.2, "y")
    home.door(4.2, 11.4, "y")
    home.window(5.6, 0, "x", 1.1, (0.0, 2.1))
    home.window(9.3, 5.4, "x", 3.2, (0.05, 2.3))
    home.window(9.3, 0, "x", 2.0)
    home.window(13.7, 0, "x", 1.4)
    home.window(15.4, 3.6, "y", 1.8)
    for y in (1.5, 7.3, 10.9):
        home.window(0, y, "y", 1.5)
    home.window(0, 4.4, "y", 0.8, (1.3, 2.1))
    for y in (7.2, 9.6):
        home.window(5.7, y, "y", 1.6, (0.4, 2.2))
    home.put("sofa", sofa(2.3), 7.9, 2.4, "S")
    home.put("television", chest(1.8, 0.4, 0.5), 8.0, 0, "N")
    home.put("armchair", armchair(), 10.3, 0.7, 130.0)
    home.put("dining table", table(1.8, 0.9), 10.6, 3.9, 90.0)
    home.put("sideboard", chest(1.6, 0.42, 0.85), 12.0, 1.15, "W")
    home.put("stove", chest(0.6, 0.5, 1.1), 6.9, 5.1, 315.0)
    home.put("kitchen", kitchen(4.2, "R"), 15.4, 2.6, "W")
    home.put("kitchen", kitchen(2.2), 13.3, 0, "N")
    home.put("larder", chest(1.4, 0.4, 2.1), 13.6, 5.4, "S")
    home.put("bed", bed(1.4, 2.0, False), 0, 1.2, "E")
    home.put("wardrobe", wardrobe(1.1), 3.2, 0, "N")
    home.put("bath", bath(1.8, 0.8), 1.2, 5.4, "S")
    home.put("shower", shower(1.0), 0, 3.5, "E")
    home.put("toilet", toilet(), 1.9, 2.9, "N")
    home.put("basin", basin(1.0), 3.1, 5.4, "S")
    home.put("bed", bed(1.8), 0, 7.4, "E")
    home.put("wardrobe", wardrobe(2.4), 2.6, 9.3, "S")
    home.put("bed", bed(0.9, 2.0, False), 0, 9.9, "E")
    home.put("desk", desk(1.3, 0.65), 1.3, 12.4, "S")
    home.put("shelf", chest(1.2, 0.35, 1.6), 3.5, 9.3, "N")
    home.put("coats", chest(1.2, 0.4, 1.9), 6.6, 0.9, "W")
    home.put("bench", chest(1.2, 0.36, 0.45), 5.0, 12.4, "S")
    return home


def draw_old_town() -> Home:
    """Rooms that open into one another, thick walls, a street front that is not square to the rest."""
    home = Home(
        "old_town",
        "old town flat: an enfilade of three salons behind thick walls, on a street that bends",
        {
            "library": [(0, 0.0), (4.6, -0.5), (4.6, 4.8), (0, 4.8)],
            "salon": [(4.6, -0.5), (10.2, -1.109), (10.2, 4.8), (4.6, 4.8)],
            "bedroom": box(10.2, -1.109, 14.4, 4.8),
            "entrance": box(0, 4.8, 3.2, 8.6),
            "dining": box(3.2, 4.8, 7.6, 8.6),
            "kitchen": box(7.6, 4.8, 11.2, 8.6),
            "bath": box(11.2, 4.8, 14.4, 8.6),
        },
        outer=0.55,
        inner=0.28,
        height=3.2,
    )
    home.raise_walls()
    home.door(4.6, 3.6, "y", 1.3, 2.4)
    home.door(10.2, 3.6, "y", 1.3, 2.4)
    home.door(1.6, 4.8, "x", 1.2, 2.4)
    home.door(3.2, 6.0, "y", 1.1, 2.4)
    home.door(5.9, 4.8, "x", 1.3, 2.4)
    home.door(7.6, 6.0, "y", 1.0, 2.2)
    home.door(12.6, 4.8, "x", 1.0, 2.2)
    slope = -0.5 / 4.6
    home.window(12.2, -1.109, "x", 1.3, (0.5, 2.7))
    for x in (2.3, 6.0, 8.7):
        a, b = x - 0.65, x + 0.65
        home.windows.append({"from": _round((a, a * slope)), "to": _round((b, b * slope)), "span": [0.5, 2.7]})
    home.window(1.5, 8.6, "x", 1.1, (0.0, 2.3))
    home.window(5.4, 8.6, "x", 1.2)
    home.window(9.6, 8.6, "x", 1.2)
    home.window(12.8, 8.6, "x", 0.8)
    home.put("bookcase", chest(3.0, 0.4, 2.4), 0, 2.6, "E")
    home.put("desk", slab(1.6, 0.8, 0.76), 2.68, 1.9, 350.0)
    home.put("chair", chair(), 1.75, 2.07, 350.0)
    home.put("bookcase", chest(1.9, 0.4, 2.4), 4.6, 1.2, "W")
    home.put("sofa", sofa(2.0), 4.6, 0.85, "E")
    home.put("armchair", armchair(), 10.2, 2.05, "W")
    home.put("round table", slab(0.9, 0.9, 0.5), 7.0, 0.95, 45.0)
    home.put("grand piano", slab(1.45, 1.5, 1.0), 9.2, 0.1, 354.0)
    home.put("sideboard", chest(1.8, 0.45, 0.95), 8.4, 4.8, "S")
    home.put("bed", bed(1.6), 14.4, 0.9, "W")
    home.put("wardrobe", wardrobe(1.7), 14.4, 3.7, "W")
    home.put("dresser", chest(1.1, 0.5, 0.8), 10.2, 0.4, "E")
    home.put("coats", chest(1.4, 0.4, 2.0), 0, 7.4, "E")
    home.put("chest", chest(1.0, 0.4, 0.7), 0, 5.7, "E")
    home.put("dining table", table(1.8, 0.95), 5.4, 7.2, 90.0)
    home.put("kitchen", kitchen(3.0, "L"), 9.5, 8.6, "S")
    home.put("kitchen", kitchen(2.0), 11.2, 6.2, "W")
    home.put("bath", bath(1.8, 0.8), 14.4, 7.3, "W")
    home.put("basin", basin(0.7), 11.2, 6.4, "E")
    home.put("toilet", toilet(), 11.2, 7.8, "E")
    home.put("cupboard", chest(0.9, 0.4, 1.9), 14.4, 5.6, "W")
    return home


def draw_family_home() -> Home:
    """Many rooms around a central hall."""
    home = Home(
        "family_home",
        "family home: eleven rooms around a hall, living, dining and kitchen open to one another",
        {
            "living": box(0, 0, 5.4, 4.6),
            "dining": box(0, 4.6, 4.2, 8.0),
            "kitchen": box(0, 8.0, 4.2, 11.2),
            "hall": [
                *[(5.4, 0), (7.6, 0), (7.6, 4.6), (10.2, 4.6), (10.2, 8.0), (8.6, 8.0), (8.6, 6.2)],
                *[(5.9, 6.2), (5.9, 8.0), (4.2, 8.0), (4.2, 4.6), (5.4, 4.6)],
            ],
            "office": box(7.6, 0, 10.8, 4.6),
            "parents": box(10.8, 0, 13.9, 4.6),
            "bath": [(10.2, 4.6), (13.9, 4.6), (13.9, 6.8), (10.2, 6.8)],
            "shower": box(5.9, 6.2, 8.6, 8.0),
            "utility": box(4.2, 8.0, 6.6, 11.2),
            "anna": [(6.6, 8.0), (10.2, 8.0), (10.2, 11.2), (6.6, 11.2)],
            "ben": [(10.2, 6.8), (13.9, 6.8), (13.9, 11.2), (10.2, 11.2)],
        },
    )
    home.open_lines = [(0.4, 4.6, 3.4, 4.6), (1.4, 8.0, 3.2, 8.0)]
    home.raise_walls()
    home.door(5.4, 3.7, "y", 1.2)
    home.door(4.2, 5.8, "y")
    home.door(7.6, 3.7, "y")
    home.door(5.05, 8.0)
    home.door(6.7, 6.2)
    home.door(9.4, 8.0)
    home.door(10.2, 7.4, "y", 0.95)
    home.door(10.2, 5.7, "y")
    home.door(11.6, 4.6)
    home.window(6.5, 0, "x", 1.1, (0.0, 2.1))
    for x in (2.7, 9.2, 12.35):
        home.window(x, 0, "x", 1.8)
    home.window(0, 2.3, "y", 2.4, (0.05, 2.3))
    for y in (6.3, 9.8):
        home.window(0, y, "y", 1.6)
    for x in (2.1, 5.4, 8.4, 12.5):
        home.window(x, 11.2, "x", 0.9 if x == 5.4 else 1.6)
    home.window(13.9, 5.8, "y", 0.9, (1.3, 2.1))
    home.window(13.9, 2.3, "y", 1.4)
    home.window(13.9, 9.2, "y", 1.4)
    home.put("sofa", sofa(2.3), 2.6, 0.0, "N")
    home.put("sofa", sofa(1.7), 0.2, 2.2, "E")
    home.put("coffee table", slab(1.0, 0.6, 0.4), 2.6, 1.95, "N")
    home.put("television", chest(1.8, 0.4, 0.5), 5.4, 1.6, "W")
    home.put("dining table", table(1.9, 0.95), 1.9, 6.3, 90.0)
    home.put("kitchen", kitchen(2.9, "R"), 0, 9.57, "E")
    home.put("kitchen", kitchen(2.9), 2.4, 11.2, "S")
    home.put("cupboard", chest(1.4, 0.4, 2.1), 4.2, 9.4, "W")
    home.put("coats", chest(1.4, 0.4, 1.9), 7.6, 1.1, "W")
    home.put("console", chest(1.0, 0.32, 0.85), 5.4, 1.6, "E")
    home.put("desk", desk(1.6, 0.75), 9.2, 0, "N")
    home.put("shelf", chest(2.2, 0.35, 2.1), 10.8, 2.6, "W")
    home.put("bed", bed(1.8), 13.9, 2.0, "W")
    home.put("wardrobe", wardrobe(2.4), 10.8, 1.5, "E")
    home.put("bath", bath(1.8, 0.8), 13.9, 5.8, "W")
    home.put("basin", basin(1.2), 11.4, 6.8, "S")
    home.put("toilet", toilet(), 12.5, 6.8, "S")
    home.put("cupboard", chest(0.7, 0.4, 1.9), 12.5, 4.6, "N")
    home.put("shower", shower(0.9), 8.6, 7.5, "W")
    home.put("toilet", toilet(), 5.9, 7.4, "E")
    home.put("basin", basin(0.5), 7.3, 8.0, "S")
    home.put("washer", chest(1.25, 0.62, 0.86), 5.0, 11.2, "S")
    home.put("shelf", chest(1.6, 0.4, 2.0), 6.6, 10.0, "W")
    home.put("bed", bed(0.9, 2.0, False), 6.6, 10.8, "E")
    home.put("wardrobe", wardrobe(1.2), 6.6, 8.9, "E")
    home.put("desk", desk(1.1, 0.6), 10.2, 10.3, "W")
    home.put("bed", bed(1.2, 2.0, False), 13.9, 10.6, "W")
    home.put("desk", desk(1.2, 0.65), 10.95, 11.2, "S")
    home.put("wardrobe", wardrobe(1.6), 12.9, 6.8, "N")
    home.put("chest", chest(0.9, 0.42, 0.8), 10.2, 9.4, "E")
    return home


HOMES = [draw_harbour_flat, draw_mill_loft, draw_garden_bungalow, draw_old_town, draw_family_home]


def check(plan: FloorPlan) -> None:
    """Every room can be reached through passages of 0.8 m, and most starts find goals 5 m away."""
    wide = FreeSpace(plan, radius=0.38)
    for label in plan.labels:
        near = wide.plan.frame.cell(np.array([label.x, label.y]))
        window = wide.regions[max(near[0] - 20, 0) : near[0] + 21, max(near[1] - 20, 0) : near[1] + 21]
        if not (window == wide.largest).any():
            print(f"  {label.name} cannot be reached through passages of 0.76 m")
    pairs = sample_start_goals(plan, 20, np.random.default_rng(0))
    straight, geodesic = np.mean([p.straight_m for p in pairs]), np.mean([p.geodesic_m for p in pairs])
    joined = (wide.regions == wide.largest).sum() / wide.traversable.sum()
    print(
        f"{plan.name}: {plan.area_m2:.0f} m2 free, {len(plan.labels)} rooms, {len(plan.furniture)} boxes of furniture,"
    )
    print(f"  {straight:.1f} m straight, {geodesic:.1f} m on foot, ways of 0.76 m join {joined:.0%} of the floor")


if __name__ == "__main__":
    for draw in HOMES:
        plan = load_floorplan(draw().write())
        save_floorplan(plan, PICTURES / f"{plan.name}.png", dpi=80)
        check(plan)
