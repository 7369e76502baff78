"""Office floors: corridors with rooms on both sides, one after another, around a core, or as a comb with blind ends."""

from __future__ import annotations

import math
from random import Random

from vinl.world.homes.config import HomeConfig
from vinl.world.homes.rooms import LEAST_SIDE, NARROWEST, Rect, Room, mirror_rooms, slice_rooms, split_rooms

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
    rooms += [Room(kind, [rect]) for kind, rect in _name_rooms(rng, [_round(rect) for rect in rects])]
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


def _name_rooms(rng: Random, rects: list[Rect]) -> list[tuple[str, Rect]]:
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
