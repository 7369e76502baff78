"""Furniture of real sizes, each piece as boxes in its own frame: u ahead from the wall at its back, v to its left [m].

Sizes are those of common furniture: beds 0.8-1.8 m wide, tables 0.72-0.77 m high, wardrobes 0.55-0.65 m deep. What
stands on legs is open below, as a camera close to the floor sees it.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial, wraps
from random import Random

Part = tuple[float, float, float, float, float, float, float]
"""u, v of the middle, turn [rad], length along u, width along v, bottom, top [m]."""

Things = list[list[Part]]
"""What stands together, thing by thing: a table and its chairs. Any thing but the first can be taken away."""


def _alone(draw: Callable[[Random], list[Part]]) -> Callable[[Random], Things]:
    """For a thing that stands with nothing else."""

    @wraps(draw)
    def draw_alone(rng: Random) -> Things:
        return [draw(rng)]

    return draw_alone


def _slab(u0: float, u1: float, v0: float, v1: float, bottom: float, top: float) -> Part:
    return ((u0 + u1) / 2, (v0 + v1) / 2, 0.0, u1 - u0, v1 - v0, bottom, top)


def _between(u0: float, u1: float, v: float, w: float, bottom: float, top: float) -> Part:
    """As ``_slab``, with v and w in any order."""
    return _slab(u0, u1, min(v, w), max(v, w), bottom, top)


def _centred(depth: float, width: float, bottom: float, top: float) -> Part:
    return (depth / 2, 0.0, 0.0, depth, width, bottom, top)


def _legs(u0: float, u1: float, half: float, top: float, thick: float = 0.05) -> list[Part]:
    """Four legs under the corners of a top that reaches from u0 to u1 and ``half`` to both sides."""
    t = thick / 2 + 0.02
    return [(u, v, 0.0, thick, thick, 0.0, top) for u in (u0 + t, u1 - t) for v in (-half + t, half - t)]


def move(parts: list[Part], u: float, v: float, turn: float = 0.0) -> list[Part]:
    """The same parts turned about their origin, then moved."""
    c, s = math.cos(turn), math.sin(turn)
    return [(u + c * a - s * b, v + s * a + c * b, yaw + turn, *rest) for a, b, yaw, *rest in parts]  # type: ignore[misc]


def chair(rng: Random) -> list[Part]:
    """Seat, back and legs; u is where the sitter looks, the origin is under the middle of the seat."""
    seat = rng.uniform(0.43, 0.47)
    parts = [
        (0.0, 0.0, 0.0, 0.42, 0.42, seat - 0.05, seat),
        (-0.195, 0.0, 0.0, 0.03, 0.4, seat, rng.uniform(0.8, 0.98)),
    ]
    if rng.random() < 0.15:  # on a foot with a column
        return [*parts, (0.0, 0.0, 0.0, 0.08, 0.08, 0.05, seat - 0.05), (0.0, 0.0, 0.0, 0.45, 0.45, 0.0, 0.05)]
    return parts + _legs(-0.21, 0.21, 0.21, seat - 0.05, 0.035)


def table_with_chairs(rng: Random, length: float, width: float) -> Things:
    """A table on four legs, its length across, centred on the origin, with chairs on both sides, some pulled out."""
    top = rng.uniform(0.72, 0.77)
    parts = [(0.0, 0.0, 0.0, width, length, top - 0.04, top), *_legs(-width / 2, width / 2, length / 2, top - 0.04)]
    if rng.random() < 0.12:
        parts = [parts[0], (0.0, 0.0, 0.0, 0.14, 0.14, 0.0, top - 0.04), (0.0, 0.0, 0.0, 0.5, 0.6, 0.0, 0.05)]
    things = [parts]
    n = max(int(length / 0.62), 1)
    for k in range(n):
        for side in (1, -1):
            if rng.random() < 0.1:
                continue
            out = rng.uniform(0.3, 0.5) if rng.random() < 0.15 else rng.uniform(0.02, 0.15)
            turn = (math.pi if side > 0 else 0.0) + (rng.gauss(0.0, 0.15) if rng.random() < 0.4 else 0.0)
            things.append(move(chair(rng), side * (width / 2 + out), ((k + 0.5) / n - 0.5) * length, turn))
    if length > 1.3 and rng.random() < 0.4:
        things += [move(chair(rng), 0.0, side * (length / 2 + 0.1), -side * math.pi / 2) for side in (1, -1)]
    return things


def dining_table(rng: Random) -> Things:
    """A table for four to eight."""
    return table_with_chairs(rng, rng.uniform(1.3, 2.3), rng.uniform(0.75, 1.05))


def table_for_two(rng: Random) -> Things:
    """A small table with two to four chairs."""
    return table_with_chairs(rng, rng.uniform(0.7, 1.2), rng.uniform(0.65, 0.8))


def bed(rng: Random, wide: bool) -> Things:
    """A bed, its head at the wall, at times with bedside tables."""
    width, length = (rng.uniform(1.35, 1.85), rng.uniform(1.95, 2.15)) if wide else (rng.uniform(0.8, 1.1), 2.0)
    top, h = rng.uniform(0.4, 0.6), width / 2
    bottom = 0.0 if rng.random() < 0.5 else rng.uniform(0.12, 0.25)
    parts = [_centred(length, width, bottom, top), _centred(0.06, width, 0.0, rng.uniform(0.8, 1.2))]
    if bottom:
        parts += _legs(0.0, length, h, bottom, 0.07)
    things = [parts]
    if rng.random() < 0.8:
        for side in (1, -1) if wide else (rng.choice((1, -1)),):
            size, gap = rng.uniform(0.35, 0.5), rng.uniform(0.03, 0.1)
            things.append([(size / 2, side * (h + gap + size / 2), 0.0, size, size, 0.0, rng.uniform(0.4, 0.6))])
    return things


double_bed, single_bed = partial(bed, wide=True), partial(bed, wide=False)


def sofa(rng: Random, length: float | None = None) -> list[Part]:
    length = length or rng.uniform(1.5, 2.5)
    depth, seat, back = rng.uniform(0.8, 1.0), rng.uniform(0.38, 0.46), rng.uniform(0.7, 0.95)
    h = length / 2
    bottom = 0.0 if rng.random() < 0.4 else rng.uniform(0.08, 0.16)
    parts = [
        _slab(0.2, depth, -h + 0.15, h - 0.15, bottom, seat),
        _slab(0.0, 0.2, -h, h, bottom, back),
        _slab(0.2, depth, -h, -h + 0.15, bottom, 0.6),
        _slab(0.2, depth, h - 0.15, h, bottom, 0.6),
    ]
    return parts + (_legs(0.0, depth, h, bottom, 0.05) if bottom else [])


def low_table(rng: Random) -> list[Part]:
    """A coffee table, its length across, the origin at its near edge."""
    length, width, top = rng.uniform(0.6, 1.3), rng.uniform(0.45, 0.75), rng.uniform(0.3, 0.5)
    if rng.random() < 0.35:
        return [_centred(width, length, 0.0, top)]
    return [_centred(width, length, top - 0.05, top), *_legs(0.0, width, length / 2, top - 0.05)]


def sofa_group(rng: Random) -> Things:
    """A sofa, a low table before it, at times a corner piece or an armchair."""
    length = rng.uniform(1.6, 2.6)
    parts = sofa(rng, length)
    if rng.random() < 0.25:  # the short arm of an L
        side = rng.choice((1, -1))
        parts.append(_between(0.9, 1.65, side * (length / 2 - 0.85), side * length / 2, 0.0, 0.43))
    if rng.random() < 0.8:
        return [parts, move(low_table(rng), rng.uniform(1.25, 1.5), 0.0)]
    return [parts]


@_alone
def armchair(rng: Random) -> list[Part]:
    return sofa(rng, rng.uniform(0.75, 0.95))


@_alone
def wardrobe(rng: Random) -> list[Part]:
    return [_centred(rng.uniform(0.55, 0.65), rng.uniform(0.9, 2.6), 0.0, rng.uniform(1.9, 2.2))]


@_alone
def shelf(rng: Random) -> list[Part]:
    width, depth = rng.uniform(0.5, 2.0), rng.uniform(0.25, 0.42)
    top = rng.uniform(1.6, 2.2) if rng.random() < 0.65 else rng.uniform(0.7, 1.2)
    return [_centred(depth, width, 0.0, top)]


@_alone
def chest(rng: Random) -> list[Part]:
    return [_centred(rng.uniform(0.38, 0.52), rng.uniform(0.6, 1.5), 0.0, rng.uniform(0.7, 1.1))]


@_alone
def television(rng: Random) -> list[Part]:
    """A low board with a screen on it."""
    width, depth, top = rng.uniform(1.1, 2.0), rng.uniform(0.35, 0.5), rng.uniform(0.4, 0.6)
    parts = [_centred(depth, width, 0.0, top)]
    if rng.random() < 0.8:
        parts.append(
            (depth / 2, 0.0, 0.0, 0.06, min(width - 0.1, rng.uniform(0.9, 1.4)), top, top + rng.uniform(0.5, 0.8))
        )
    return parts


def desk(rng: Random) -> Things:
    width, depth, top = rng.uniform(1.0, 1.7), rng.uniform(0.55, 0.8), rng.uniform(0.71, 0.76)
    h = width / 2
    parts = [_centred(depth, width, top - 0.04, top)]
    if rng.random() < 0.5:
        parts += _legs(0.0, depth, h, top - 0.04)
    else:  # a drawer unit on one side, a panel on the other
        side = rng.choice((1, -1))
        parts.append(_between(0.05, depth - 0.05, side * (h - 0.42), side * h, 0.0, top - 0.04))
        parts.append(_between(0.05, depth - 0.05, -side * (h - 0.03), -side * h, 0.0, top - 0.04))
    if rng.random() > 0.85:
        return [parts]
    out, aside = depth + rng.uniform(0.0, 0.3), rng.uniform(-0.15, 0.15)
    return [parts, move(chair(rng), out, aside, math.pi + rng.gauss(0.0, 0.3))]


def short_counter(rng: Random) -> Things:
    """The second run of a kitchen."""
    return counter(rng, rng.uniform(1.2, 2.2))


@_alone
def pillar(rng: Random) -> list[Part]:
    """A column up to the ceiling."""
    side = rng.uniform(0.25, 0.45)
    return [_centred(side, side, 0.0, 2.3)]


def counter(rng: Random, width: float | None = None) -> Things:
    """A kitchen run: units 0.6 m deep, at times a fridge at one end, and cupboards on the wall above."""
    width = width or rng.uniform(1.8, 3.6)
    h, top = width / 2, rng.uniform(0.86, 0.94)
    low, high, parts = -h, h, []
    if width > 1.7 and rng.random() < 0.7:
        side = rng.choice((1, -1))
        parts.append(_between(0.0, 0.64, side * (h - 0.62), side * h, 0.0, rng.uniform(1.5, 2.05)))
        low, high = (low, high - 0.62) if side > 0 else (low + 0.62, high)
    parts.append(_slab(0.0, 0.6, low, high, 0.0, top))
    if rng.random() < 0.75:
        parts.append(_slab(0.0, 0.35, low, high, 1.4, 2.1))
    return [parts]


def island(rng: Random) -> Things:
    """A free-standing kitchen block, centred on the origin, at times with stools."""
    width, depth = rng.uniform(1.2, 2.2), rng.uniform(0.65, 1.0)
    things: Things = [[(0.0, 0.0, 0.0, depth, width, 0.0, rng.uniform(0.88, 0.95))]]
    if rng.random() < 0.6:
        n = int(width / 0.55)
        for k in range(n):
            v = ((k + 0.5) / n - 0.5) * width
            stool = [(0.0, 0.0, 0.0, 0.36, 0.36, 0.62, 0.66), *_legs(-0.17, 0.17, 0.17, 0.62, 0.035)]
            things.append(move(stool, depth / 2 + 0.2, v))
    return things


@_alone
def toilet(rng: Random) -> list[Part]:
    return [_slab(0.0, 0.18, -0.19, 0.19, 0.0, rng.uniform(0.75, 1.0)), _slab(0.18, 0.66, -0.18, 0.18, 0.0, 0.42)]


@_alone
def basin(rng: Random) -> list[Part]:
    """A wash-stand on the floor, or a basin on a column."""
    if rng.random() < 0.5:
        return [_centred(rng.uniform(0.4, 0.52), rng.uniform(0.5, 1.1), 0.0, 0.85)]
    return [_centred(0.45, 0.55, 0.68, 0.86), _slab(0.1, 0.3, -0.09, 0.09, 0.0, 0.68)]


@_alone
def bath(rng: Random) -> list[Part]:
    """A bath; its long side lies at the wall."""
    return [_centred(rng.uniform(0.7, 0.8), rng.uniform(1.5, 1.8), 0.0, rng.uniform(0.5, 0.62))]


@_alone
def shower(rng: Random) -> list[Part]:
    """A tray too high for the robot, with glass on two sides."""
    side = rng.uniform(0.8, 1.0)
    h = side / 2
    return [_centred(side, side, 0.0, 0.3), _slab(side - 0.03, side, -h, h, 0.3, 2.0)]


@_alone
def washer(rng: Random) -> list[Part]:
    return [_centred(0.6, 0.6, 0.0, 0.85)]


@_alone
def shoe_rack(rng: Random) -> list[Part]:
    return [_centred(rng.uniform(0.2, 0.36), rng.uniform(0.6, 1.2), 0.0, rng.uniform(0.45, 1.1))]


@_alone
def stand(rng: Random) -> list[Part]:
    """Something small: a plant in its pot, a basket, a box, a stool, a floor lamp."""
    kind = rng.randrange(5)
    if kind == 0:  # a pot below, leaves above
        pot = rng.uniform(0.25, 0.4)
        leaf = pot + rng.uniform(0.0, 0.3)
        return [
            _centred(pot, pot, 0.0, 0.35),
            (pot / 2, 0.0, 0.6, leaf, leaf, rng.uniform(0.6, 0.7), rng.uniform(0.9, 1.8)),
        ]
    if kind == 1:
        return [_centred(rng.uniform(0.3, 0.5), rng.uniform(0.3, 0.6), 0.0, rng.uniform(0.3, 0.6))]
    if kind == 2:
        return [_centred(0.36, 0.36, 0.4, 0.45), *_legs(0.0, 0.36, 0.18, 0.4, 0.035)]
    if kind == 3:
        return [_centred(0.3, 0.3, 0.0, 0.04), (0.15, 0.0, 0.0, 0.04, 0.04, 0.0, 1.4), _centred(0.36, 0.36, 1.3, 1.65)]
    return [_centred(rng.uniform(0.4, 0.6), rng.uniform(0.4, 0.7), 0.0, rng.uniform(0.35, 0.95))]


@_alone
def side_table(rng: Random) -> list[Part]:
    size, top = rng.uniform(0.35, 0.6), rng.uniform(0.45, 0.65)
    return [_centred(size, size, top - 0.04, top), *_legs(0.0, size, size / 2, top - 0.04, 0.04)]
