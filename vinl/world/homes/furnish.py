"""Furniture in its place: what belongs into which room, against walls, off doors, not through one another."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from random import Random

from vinl.world.homes import catalogue as make
from vinl.world.homes.catalogue import Part, Things
from vinl.world.homes.config import HomeConfig
from vinl.world.homes.rooms import Rect, Room
from vinl.world.homes.walls import Row, Shell

Maker = Callable[[Random], Things]

Wish = tuple[Maker, float, str]
"""How things are made, how likely it is at density 1 (1: nearly always), and where it stands: at a ``wall``, in a
``corner``, about the ``middle`` of a wall, ``free`` before a wall, in the ``centre`` of the room, or anywhere on the
``floor``."""

TABLE: dict[str, list[Wish]] = {
    "bedroom": [
        (make.wardrobe, 0.95, "corner"),
        (make.chest, 0.5, "wall"),
        (make.desk, 0.35, "wall"),
        (make.shelf, 0.3, "wall"),
        (make.armchair, 0.15, "corner"),
    ],
    "child": [
        (make.single_bed, 1.0, "corner"),
        (make.desk, 0.8, "wall"),
        (make.wardrobe, 0.6, "corner"),
        (make.shelf, 0.7, "wall"),
        (make.single_bed, 0.3, "corner"),
        (make.stand, 0.6, "floor"),
    ],
    "dining": [(make.dining_table, 1.0, "centre"), (make.chest, 0.8, "wall"), (make.shelf, 0.4, "wall")],
    "bath": [(make.toilet, 0.95, "wall"), (make.basin, 0.95, "wall"), (make.washer, 0.4, "corner")],
    "wc": [(make.toilet, 1.0, "middle"), (make.basin, 0.8, "wall")],
    "store": [
        (make.shelf, 0.9, "wall"),
        (make.shelf, 0.7, "wall"),
        (make.washer, 0.4, "corner"),
        (make.stand, 0.7, "floor"),
    ],
    "office": [
        (make.desk, 1.0, "wall"),
        (make.shelf, 0.9, "wall"),
        (make.shelf, 0.7, "wall"),
        (make.armchair, 0.4, "corner"),
        (make.table_for_two, 0.2, "centre"),
    ],
    "bureau": [(make.shelf, 0.9, "wall"), (make.shelf, 0.4, "wall"), (make.table_for_two, 0.2, "centre")],
    "meeting": [(make.dining_table, 1.0, "centre"), (make.chest, 0.6, "wall"), (make.shelf, 0.3, "wall")],
    "hall": [(make.shoe_rack, 0.7, "wall"), (make.shoe_rack, 0.3, "wall")],
    "living": [
        (make.television, 0.8, "middle"),
        (make.shelf, 0.8, "wall"),
        (make.armchair, 0.6, "corner"),
        (make.side_table, 0.3, "corner"),
        (make.chest, 0.4, "wall"),
    ],
    "kitchen": [(make.shelf, 0.2, "wall")],
}


def draw_wishes(rng: Random, room: Room) -> list[Wish]:
    """The furniture of a room, the most important first; what depends on its size is drawn here."""
    area, kind = room.area, room.kind
    wishes: list[Wish] = []
    if kind == "bedroom":
        wishes.append((make.double_bed if area > 8.5 else make.single_bed, 1.0, "middle" if area > 10 else "wall"))
    elif kind == "bath":
        wishes.append((make.bath if area > 4.0 and rng.random() < 0.6 else make.shower, 1.0, "corner"))
    elif kind == "kitchen":
        wishes += [(make.counter, 1.0, "corner"), (make.short_counter, 0.7, "corner")]
        if area > 16 and rng.random() < 0.5:
            wishes.append((make.island, 0.8, "centre"))
        elif area > 14:
            wishes.append((make.dining_table, 0.9, "centre"))
        else:
            wishes.append((make.table_for_two, 0.8 if area > 8 else 0.3, "floor"))
    elif kind == "bureau":
        wishes += [(make.desk, 0.9, "wall")] * max(int(area / 7.0), 1)
    elif kind in ("living", "studio"):
        wishes += _wish_for_living(rng, area, kind == "studio" or (area > 30 and rng.random() < 0.3))
    wishes += TABLE["living" if kind == "studio" else kind]
    if kind not in ("wc", "bath"):
        wishes.append((make.stand, 0.5, "corner"))
        wishes += [(make.stand, 0.3, "floor")] * int(area / 12)
    return wishes


def _wish_for_living(rng: Random, area: float, cooking: bool) -> list[Wish]:
    """Somewhere to sit, in large rooms twice; a kitchen where there is none beside."""
    wishes: list[Wish] = [(make.sofa_group, 1.0, "free" if area > 28 and rng.random() < 0.4 else "middle")]
    if cooking:
        wishes.append((make.counter, 1.0, "corner"))
        if area > 32:
            wishes.append((make.island, 0.5, "floor"))
    if cooking or area > 20:
        wishes.append((make.dining_table, 0.85, "floor"))
    for _ in range(int(area / 18)):
        wishes += [(make.shelf, 0.4, "wall"), (make.armchair, 0.4, "floor"), (make.stand, 0.5, "floor")]
    if area > 45:
        wishes += [(make.sofa_group, 0.6, "free"), (make.desk, 0.5, "wall"), (make.chest, 0.5, "wall")]
        wishes += [(make.pillar, 0.4, "floor")] * int(area / 20)
    return wishes


TRIES = 10
"""Places tried for a piece before it is left out."""


@dataclass
class Piece:
    """Boxes of a piece of furniture in its place in a room; not chief is what stands with something else: chairs at a
    table, tables beside a bed."""

    room: int
    rows: list[Row]
    chief: bool = True


@dataclass
class Face:
    """A stretch of wall seen from a room: where it lies, and which way the room is.

    ``upright`` walls run along y; ``side`` is +1 where the room lies at larger coordinates.
    """

    upright: bool
    at: float
    low: float
    high: float
    side: int


@dataclass
class Floor:
    """A room while it is furnished: the rectangles between its walls, its wall faces, and what is taken."""

    rects: list[Rect]
    faces: list[Face]
    taken: list[Rect]


def furnish(rng: Random, shell: Shell, config: HomeConfig) -> list[Piece]:
    """Furniture for all rooms of a home, as full as the home's density says."""
    bare = rng.random() < config.bare_share
    density = rng.uniform(*config.furniture_density)
    if bare or density == 0.0:
        return []
    pieces: list[Piece] = []
    for k, room in enumerate(shell.rooms):
        floor = _find_floor(shell, k)
        local = density * rng.uniform(0.6, 1.3)
        for maker, wish, where in draw_wishes(rng, room):
            # each wish is fulfilled by chance; above a density of 1 some are fulfilled twice
            count = int(local * wish) + (rng.random() < (local * wish) % 1.0) if wish < 1.0 else 1
            if wish >= 1.0 and rng.random() > 0.5 + local:
                continue
            for _ in range(count):
                things = _place(rng, floor, maker, where, config.askew_share)
                if not things and wish >= 1.0:  # another size may fit
                    things = _place(rng, floor, maker, "wall", 0.0)
                pieces += [Piece(k, rows, n == 0) for n, rows in enumerate(things)]
    return pieces


def _find_floor(shell: Shell, room: int) -> Floor:
    """The room between its walls, and the stretches of wall that furniture may stand at."""
    faces: list[Face] = []
    keep = shell.outer / 2
    rects = []
    for rect in shell.rooms[room].rects:
        sides = list(rect)
        for edge in shell.edges:
            across, along = (0, 1) if edge.upright else (1, 0)
            if room not in edge.rooms or edge.low >= rect[along + 2] or edge.high <= rect[along]:
                continue
            half = (shell.outer if min(edge.rooms) < 0 else shell.inner) / 2
            if edge.at == rect[across] and edge.rooms[1] == room:
                sides[across] = max(sides[across], edge.at + half)
            if edge.at == rect[across + 2] and edge.rooms[0] == room:
                sides[across + 2] = min(sides[across + 2], edge.at - half)
        rects.append((sides[0], sides[1], sides[2], sides[3]))
    for edge in shell.edges:
        if room not in edge.rooms:
            continue
        half = (shell.outer if min(edge.rooms) < 0 else shell.inner) / 2
        side = 1 if edge.rooms[1] == room else -1
        start = edge.low + keep
        for low, high, _ in [*sorted(edge.gaps), (edge.high - keep, 0.0, 0.0)]:
            if low - start > 0.3:
                faces.append(Face(edge.upright, edge.at + side * half, start, low, side))
            start = high
    return Floor(rects, faces, list(shell.clear[room]))


def _place(rng: Random, floor: Floor, maker: Maker, where: str, askew: float) -> list[list[Row]]:
    """Try places until the things stand on free floor; nothing if there is none."""
    things = maker(rng)
    u0, u1, v0, v1 = _measure([part for parts in things for part in parts])
    u, v = (u0 + u1) / 2, (v0 + v1) / 2
    depth, width = u1 - u0, v1 - v0
    out_of_place = rng.random() < askew
    if out_of_place and depth * width < 1.6:
        where = "floor"
    for attempt in range(TRIES):
        if attempt == TRIES // 2 and where in ("middle", "free", "corner"):
            where = "wall"
        spot = _find_spot(rng, floor, depth, width, where)
        if spot is None:
            continue
        x, y, facing = spot
        turn = 0.0
        if where == "floor" and (out_of_place or rng.random() < 0.15):
            turn = rng.uniform(-math.pi, math.pi)
        elif where in ("floor", "centre", "free") and rng.random() < 0.4:
            turn = rng.gauss(0.0, 0.08)
        rect = _reach(x, y, facing, depth, width, turn)
        if not _fits(rect, floor, 0.04 if where in ("wall", "corner", "middle") else 0.1):
            continue
        floor.taken.append(rect)
        # what is drawn stands on the middle of the rectangle around it
        return [_stand(make.move(parts, -u, -v), x, y, facing, turn) for parts in things]
    return []


def _measure(parts: list[Part]) -> tuple[float, float, float, float]:
    """Least and largest u, then v, that the parts reach to [m]."""
    reach = []
    for u, v, turn, length, width, _, _ in parts:
        c, s = abs(math.cos(turn)) / 2, abs(math.sin(turn)) / 2
        a, b = c * length + s * width, s * length + c * width
        reach.append((u - a, u + a, v - b, v + b))
    u0, u1, v0, v1 = zip(*reach, strict=True)
    return min(u0), max(u1), min(v0), max(v1)


def _find_spot(rng: Random, floor: Floor, depth: float, width: float, where: str) -> tuple[float, float, int] | None:
    """Middle of the piece [m] and the quarter it faces (0: +x, 1: +y, 2: -x, 3: -y)."""
    if where in ("floor", "centre"):
        x0, y0, x1, y1 = floor.rects[rng.randrange(len(floor.rects))]
        facing = rng.randrange(4)
        a, b = (depth, width) if facing % 2 == 0 else (width, depth)
        if x1 - x0 < a + 0.1 or y1 - y0 < b + 0.1:
            return None
        if where == "centre" and rng.random() < 0.8:
            return (x0 + x1) / 2 + rng.gauss(0.0, 0.25), (y0 + y1) / 2 + rng.gauss(0.0, 0.25), facing
        return rng.uniform(x0 + a / 2, x1 - a / 2), rng.uniform(y0 + b / 2, y1 - b / 2), facing
    faces = [face for face in floor.faces if face.high - face.low >= width + 0.02]
    if not faces:
        return None
    face = faces[rng.randrange(len(faces))]
    spare = face.high - face.low - width
    if where == "corner":
        along = 0.01 if rng.random() < 0.5 else spare - 0.01
    elif where == "middle" and rng.random() < 0.7:
        along = spare * rng.uniform(0.4, 0.6)
    else:
        along = rng.uniform(0.01, spare - 0.01)
    along += face.low + width / 2
    off = rng.uniform(0.8, 1.8) if where == "free" else 0.01 if rng.random() < 0.7 else rng.uniform(0.01, 0.06)
    across = face.at + face.side * (depth / 2 + off)
    if face.upright:
        return across, along, 0 if face.side > 0 else 2
    return along, across, 1 if face.side > 0 else 3


def _reach(x: float, y: float, facing: int, depth: float, width: float, turn: float) -> Rect:
    """The upright rectangle around the piece."""
    a, b = (depth, width) if facing % 2 == 0 else (width, depth)
    if turn:
        c, s = abs(math.cos(turn)), abs(math.sin(turn))
        a, b = c * a + s * b, s * a + c * b
    return (x - a / 2, y - b / 2, x + a / 2, y + b / 2)


def _fits(rect: Rect, floor: Floor, gap: float) -> bool:
    """Whether a piece is inside the room and off everything else."""
    x0, y0, x1, y1 = rect
    for a, b, c, d in floor.taken:
        if x0 < c + gap and x1 > a - gap and y0 < d + gap and y1 > b - gap:
            return False
    return any(x0 >= a and y0 >= b and x1 <= c and y1 <= d for a, b, c, d in floor.rects)


def _stand(parts: list[Part], x: float, y: float, facing: int, turn: float) -> list[Row]:
    """Parts to boxes in the world; those at right angles get sides along x and y and no turn."""
    angle = facing * math.pi / 2 + turn
    c, s = (1, 0, -1, 0)[facing], (0, 1, 0, -1)[facing]
    if turn:
        c, s = math.cos(angle), math.sin(angle)
    rows: list[Row] = []
    for u, v, own, length, width, bottom, top in parts:
        yaw = own + angle
        quarter = round(yaw / (math.pi / 2))
        if abs(yaw - quarter * math.pi / 2) < 1e-6:
            yaw = 0.0
            if quarter % 2:
                length, width = width, length
        at = round(x + c * u - s * v, 4), round(y + s * u + c * v, 4)
        sizes = round(yaw, 4), round(length, 4), round(width, 4), round(bottom, 4), round(top, 4)
        rows.append((*at, *sizes))
    return rows
