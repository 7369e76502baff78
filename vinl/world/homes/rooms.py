"""Which rooms a floor has and where they lie: a footprint, cut into rectangles, each given a use."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from random import Random

from vinl.world.homes.config import HomeConfig

Rect = tuple[float, float, float, float]
"""x0, y0, x1, y1 on the middle lines of the walls [m]."""

NARROWEST = 1.7
"""Least side of a room between the middle lines of its walls [m]: a bath."""

LEAST_SIDE = 2.5
"""Least side of what is not a bath or a store [m]."""

WING = 3.2
"""Least side of a wing [m]."""


@dataclass
class Room:
    """A room: what it is for and the rectangles that it consists of, with no walls between these."""

    kind: str
    rects: list[Rect]

    @property
    def area(self) -> float:
        """Floor [m2], walls counted to their middle lines."""
        return sum(measure(rect) for rect in self.rects)


def measure(rect: Rect) -> float:
    """Area of a rectangle [m2]."""
    return (rect[2] - rect[0]) * (rect[3] - rect[1])


def draw_rooms(rng: Random, config: HomeConfig) -> list[Room]:
    """Draw a footprint and cut it into rooms; all in one corner of the world, from (0, 0) on."""
    low, high = config.area
    area = math.exp(rng.uniform(math.log(low), math.log(high * 0.98)))
    wings = _draw_wings(rng, area, config)
    rects: list[Rect] = []
    halls: list[Rect] = []
    loft = rng.random() < config.loft_share and config.layout != "dead_ends"
    # larger homes have larger rooms, not only more of them
    room = rng.uniform(12.0, 22.0) * max(1.0, (area / 110.0) ** 0.5)
    for wing in wings:
        if loft:
            _cut_loft(wing, rng, rects)
        elif rng.random() >= config.corridor_share or not _cut_along_corridor(wing, rng, config, rects, halls):
            split_rooms(wing, rng, room, rects)
    rects = _drop_corner(rng, rects, halls, low)
    rooms = _name_rooms(rng, rects, halls)
    if rng.random() < config.open_plan_share and config.layout != "dead_ends":
        rooms = _open_plan(rng, rooms)
    return mirror_rooms(rng, rooms)


def _draw_wings(rng: Random, area: float, config: HomeConfig) -> list[Rect]:
    """One rectangle, or the two of an L."""
    aspect = math.exp(rng.uniform(0.0, math.log(2.1)))
    if rng.random() < config.l_shape_share:
        cut_x, cut_y = rng.uniform(0.25, 0.6), rng.uniform(0.3, 0.6)
        width = math.sqrt(area * aspect / (1 - cut_x * cut_y))
        height = width / aspect
        w, h, x, y = (round(v, 2) for v in (width, height, (1 - cut_x) * width, (1 - cut_y) * height))
        if min(x, y, h - y) >= WING:
            return [(0.0, 0.0, w, y), (0.0, y, x, h)]
    width = round(math.sqrt(area * aspect), 2)
    return [(0.0, 0.0, width, round(area / width, 2))]


def split_rooms(rect: Rect, rng: Random, size: float, out: list[Rect]) -> None:
    """Halve until the rooms are about as large as wanted [m2]."""
    x0, y0, x1, y1 = rect
    w, h = x1 - x0, y1 - y0
    long, short = max(w, h), min(w, h)
    if (w * h <= size * rng.uniform(0.7, 1.8) and long < 2.4 * short) or long < NARROWEST + LEAST_SIDE:
        out.append(rect)
        return
    least = NARROWEST if long < NARROWEST + LEAST_SIDE + 1.0 else LEAST_SIDE
    at = min(max(rng.uniform(0.3, 0.7) * long, least), long - least)
    for part in _halve(rect, at, w >= h if rng.random() < 0.85 or short < 2 * LEAST_SIDE else w < h):
        split_rooms(part, rng, size, out)


def _halve(rect: Rect, at: float, across_x: bool) -> tuple[Rect, Rect]:
    """Two parts, the first ``at`` metres long along x or y, held so that both keep the narrowest side."""
    x0, y0, x1, y1 = rect
    if across_x:
        c = round(min(max(x0 + at, x0 + NARROWEST), x1 - NARROWEST), 2)
        return (x0, y0, c, y1), (c, y0, x1, y1)
    c = round(min(max(y0 + at, y0 + NARROWEST), y1 - NARROWEST), 2)
    return (x0, y0, x1, c), (x0, c, x1, y1)


def _cut_along_corridor(rect: Rect, rng: Random, config: HomeConfig, out: list[Rect], halls: list[Rect]) -> bool:
    """A corridor along the long side with rooms on both sides, or on one; false if the wing is too small."""
    x0, y0, x1, y1 = rect
    turned = y1 - y0 > x1 - x0
    if turned:
        x0, y0, x1, y1 = y0, x0, y1, x1
    length, depth = x1 - x0, y1 - y0
    width = rng.uniform(*config.corridor_width)
    if depth < width + LEAST_SIDE + 0.3 or length < 5.5:
        return False
    if depth < width + 2 * LEAST_SIDE + 0.2:
        low = 0.0 if rng.random() < 0.5 else depth - width
    else:
        low = min(max(rng.uniform(0.35, 0.65) * (depth - width), LEAST_SIDE), depth - width - LEAST_SIDE)
    a, b = round(y0 + low, 2), round(y0 + low + width, 2)
    if low == 0.0:
        a = y0
    elif low == depth - width:
        b = y1
    rooms: list[Rect] = []
    start, end = x0, x1
    if length > 8.0 and rng.random() < 0.6:  # one room takes the whole end, the corridor stops at its wall
        if rng.random() < 0.5:
            end = round(x1 - rng.uniform(3.2, min(5.5, length * 0.45)), 2)
            rooms.append((end, y0, x1, y1))
        else:
            start = round(x0 + rng.uniform(3.2, min(5.5, length * 0.45)), 2)
            rooms.append((x0, y0, start, y1))
    for low_y, high_y in ((y0, a), (b, y1)):
        if high_y - low_y > 1.0:
            rooms += slice_rooms(start, end, low_y, high_y, rng)
    hall = (start, a, end, b)
    out += [_swap(room) if turned else room for room in rooms]
    halls.append(_swap(hall) if turned else hall)
    return True


def slice_rooms(x0: float, x1: float, y0: float, y1: float, rng: Random) -> list[Rect]:
    """Rooms side by side, of uneven widths, a few of them as narrow as a bath."""
    length, depth = x1 - x0, y1 - y0
    wanted = min(max(rng.uniform(10.0, 22.0) / depth, 2.6), 6.0)
    shares, narrow, left = [], [], length
    while left > 0.6 * wanted or not shares:
        thin = rng.random() < 0.25 and left < length - 0.1
        narrow.append(rng.uniform(NARROWEST, 2.3) if thin else 0.0)
        shares.append(0.0 if thin else rng.uniform(0.8, 1.4))
        left -= narrow[-1] or wanted * shares[-1]
    spare = length - sum(narrow)
    if spare < LEAST_SIDE * sum(share > 0 for share in shares):
        return [(x0, y0, x1, y1)]
    order = list(range(len(shares)))
    rng.shuffle(order)
    edges = [x0]
    for k in order[:-1]:
        edges.append(round(edges[-1] + (narrow[k] or spare * shares[k] / sum(shares)), 2))
    edges.append(x1)
    return [(a, y0, b, y1) for a, b in pairwise(edges)]


def _cut_loft(rect: Rect, rng: Random, out: list[Rect]) -> None:
    """One large room with one to three small ones cut off at an end."""
    x0, y0, x1, y1 = rect
    w, h = x1 - x0, y1 - y0
    strip = rng.uniform(2.2, 3.6)
    if max(w, h) < strip + 4.5:
        split_rooms(rect, rng, 14.0, out)
        return
    small, large = _halve(rect, strip, w >= h)
    if rng.random() < 0.5:
        large, small = _halve(rect, max(w, h) - strip, w >= h)
    out.append(large)
    split_rooms(small, rng, rng.uniform(6.0, 14.0), out)


def _swap(rect: Rect) -> Rect:
    return rect[1], rect[0], rect[3], rect[2]


def _drop_corner(rng: Random, rects: list[Rect], halls: list[Rect], least: float) -> list[Rect]:
    """At times leave a room at the footprint's corner away, so that outlines become stepped."""
    if len(rects) < 5 or rng.random() > 0.25:
        return rects
    x1, y1 = max(r[2] for r in rects), max(r[3] for r in rects)
    corners = [r for r in rects if r[3] == y1 and (r[2] == x1 or r[0] == 0.0)]
    total = sum(map(measure, rects)) + sum(map(measure, halls))
    corners = [r for r in corners if total - measure(r) >= least and measure(r) < 0.3 * total]
    if not corners:
        return rects
    gone = corners[rng.randrange(len(corners))]
    return [r for r in rects if r is not gone]


def _name_rooms(rng: Random, rects: list[Rect], halls: list[Rect]) -> list[Room]:
    """Give every rectangle a use by its size: the largest is the living room, the small ones baths and stores."""
    order = sorted(rects, key=measure, reverse=True)
    small = [r for r in order if measure(r) < 8.0 or min(r[2] - r[0], r[3] - r[1]) < 2.2]
    if not small and len(order) >= 2:  # every home has a bath: cut one off a middling room
        whole = order[min(len(order) - 1, 1 + rng.randrange(3))]
        w, h = whole[2] - whole[0], whole[3] - whole[1]
        if max(w, h) > NARROWEST + LEAST_SIDE:
            bath, rest = _halve(whole, rng.uniform(NARROWEST, 2.3), w >= h)
            order = sorted([r for r in order if r is not whole] + [rest], key=measure, reverse=True)
            small = [bath]
        else:
            small = [order[-1]]
    large = [r for r in order if r not in small]
    if not large:
        large, small = small[:1], small[1:]
    # the living room is large and lies at many others
    hub = max(large[:3], key=lambda r: measure(r) * (1.0 + 0.12 * sum(_touch(r, other) for other in rects)))
    large = [hub, *(r for r in large if r is not hub)]
    rooms = [Room("hall", [r]) for r in halls] + [Room("living", [large[0]])]
    rest = sorted(large[1:], key=lambda r: (not _touch(r, large[0]), rng.random()))
    uses = ["kitchen", "bedroom", "bedroom"]
    extra = ["bedroom", "office", "dining", "child", "bedroom", "living", "child", "office"]
    rooms += [Room(uses[k] if k < 3 else extra[rng.randrange(len(extra))], [r]) for k, r in enumerate(rest)]
    rng.shuffle(small)
    baths = ["bath", "wc", "store", "bath", "store"]
    rooms += [Room(baths[k % 5], [r]) for k, r in enumerate(small)]
    return rooms


def _touch(a: Rect, b: Rect) -> bool:
    """Whether two rectangles share at least 1.5 m of an edge."""
    beside = (a[2] == b[0] or b[2] == a[0]) and min(a[3], b[3]) - max(a[1], b[1]) >= 1.5
    above = (a[3] == b[1] or b[3] == a[1]) and min(a[2], b[2]) - max(a[0], b[0]) >= 1.5
    return beside or above


def _open_plan(rng: Random, rooms: list[Room]) -> list[Room]:
    """Take the walls between living room, kitchen and at times dining room and corridor away."""
    living = next(room for room in rooms if room.kind == "living")
    joined = {"kitchen", "dining"} | ({"hall"} if rng.random() < 0.5 else set())
    kept = []
    for room in rooms:
        if room.kind in joined and any(_touch(room.rects[0], rect) for rect in living.rects):
            living.rects += room.rects
            living.kind = "studio"
        else:
            kept.append(room)
    return kept


def mirror_rooms(rng: Random, rooms: list[Room]) -> list[Room]:
    """Mirror and swap the axes at random."""
    x1 = max(rect[2] for room in rooms for rect in room.rects)
    y1 = max(rect[3] for room in rooms for rect in room.rects)
    mirror_x, mirror_y, swap = (rng.random() < 0.5 for _ in range(3))

    def turn(rect: Rect) -> Rect:
        a, b, c, d = rect
        if mirror_x:
            a, c = round(x1 - c, 2), round(x1 - a, 2)
        if mirror_y:
            b, d = round(y1 - d, 2), round(y1 - b, 2)
        return (b, a, d, c) if swap else (a, b, c, d)

    return [Room(room.kind, [turn(rect) for rect in room.rects]) for room in rooms]


_DEPTH = (3.2, 5.2)
"""Depth of the rooms along a corridor [m]."""

_CORE = 3.2
"""Least side of the block of rooms inside a ring of corridors [m]."""

_LONGEST = 36.0
"""A floor with one corridor is at most so long [m]."""

_SMALL = 8.0
"""Rooms below this are washrooms and stores [m2]."""


def draw_office(rng: Random, config: HomeConfig) -> list[Room]:
    """The rooms of an office floor, all in one corner of the world, from (0, 0) on; its corridors are one room. None
    where no plan fits what was drawn."""
    low, high = config.area
    area = math.exp(rng.uniform(math.log(low), math.log(high * 0.98)))
    wide, depth = rng.uniform(*config.corridor_width), rng.uniform(*_DEPTH)
    plans = [_draw_spine, _draw_ring, _draw_comb]
    rng.shuffle(plans)
    drawn = (draw(rng, area, wide, depth) for draw in plans)
    found = next((plan for plan in drawn if plan is not None), None)
    if found is None:
        return []
    halls, rects = found
    rooms = [Room("hall", [_round(rect) for rect in halls])]
    rooms += [Room(kind, [rect]) for kind, rect in _name_office(rng, [_round(rect) for rect in rects])]
    return mirror_rooms(rng, rooms)


def _draw_spine(rng: Random, area: float, wide: float, depth: float) -> tuple[list[Rect], list[Rect]] | None:
    """One corridor from end to end; both ends are blind. None if it would be too long."""
    other = rng.uniform(*_DEPTH)
    height = depth + wide + other
    width = area / height
    if width > _LONGEST:
        return None
    low, high = round(depth, 2), round(depth + wide, 2)
    rects = slice_rooms(0.0, width, 0.0, low, rng) + slice_rooms(0.0, width, high, height, rng)
    return [(0.0, low, width, high)], rects


def _draw_ring(rng: Random, area: float, wide: float, depth: float) -> tuple[list[Rect], list[Rect]] | None:
    """Corridors around a core of rooms; rooms outside of them all around. None if the floor is too small."""
    aspect = math.exp(rng.uniform(0.0, math.log(2.0)))
    width = math.sqrt(area * aspect)
    height = area / width
    inner = depth + wide
    if min(width, height) - 2 * inner < _CORE:
        return None
    a, b, c, d = depth, inner, width - inner, width - depth
    e, f = height - inner, height - depth
    halls = [(a, a, d, b), (a, e, d, f), (a, b, b, e), (c, b, d, e)]
    rects: list[Rect] = []
    for low, high in ((0.0, a), (f, height)):  # the first and the last one take the corners
        row = slice_rooms(a, d, low, high, rng)
        row[0] = (0.0, *row[0][1:])
        row[-1] = (row[-1][0], row[-1][1], width, row[-1][3])
        rects += row
    for low, high in ((0.0, a), (d, width)):
        rects += [(low, y0, high, y1) for y0, _, y1, _ in slice_rooms(a, f, low, high, rng)]
    split_rooms((b, b, c, e), rng, 14.0, rects)
    return halls, rects


def _draw_comb(rng: Random, area: float, wide: float, depth: float) -> tuple[list[Rect], list[Rect]] | None:
    """A corridor with blind corridors off it on one side, rooms along all of them. None if the floor is too small."""
    column = rng.uniform(LEAST_SIDE + 0.3, 4.5)
    block = 2 * column + wide
    count = rng.randint(2, 3)
    width = count * block
    height = area / width
    low, high = round(depth, 2), round(depth + wide, 2)
    if height - high < 6.0 or height - high > 18.0:
        return None
    halls: list[Rect] = [(0.0, low, width, high)]
    rects = slice_rooms(0.0, width, 0.0, low, rng)
    for k in range(count):
        left = round(k * block + column, 2)
        right, start, end = round(left + wide, 2), round(k * block, 2), round((k + 1) * block, 2)
        halls.append((left, high, right, height))
        for x0, x1 in ((start, left), (right, end)):
            rects += [(x0, y0, x1, y1) for y0, _, y1, _ in slice_rooms(high, height, x0, x1, rng)]
    return halls, rects


def _round(rect: Rect) -> Rect:
    x0, y0, x1, y1 = (round(value, 2) for value in rect)
    return x0, y0, x1, y1


def _name_office(rng: Random, rects: list[Rect]) -> list[tuple[str, Rect]]:
    """The small ones are washrooms and stores, one is a kitchen, the others offices and meeting rooms."""
    named, kitchens = [], 0
    for rect in rects:
        sides = rect[2] - rect[0], rect[3] - rect[1]
        if sides[0] * sides[1] < _SMALL or min(sides) < NARROWEST + 0.5:
            kind = rng.choice(("wc", "store"))
        elif not kitchens and rng.random() < 0.2:
            kind, kitchens = "kitchen", 1
        else:
            kind = "meeting" if rng.random() < 0.2 else "bureau"
        named.append((kind, rect))
    return named
