"""Training tiles of blocks and walls: closed rings and bars that nobody can walk around, and small rooms with doorways
and corners to turn in."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from jaxtyping import Float

from vinl.world.blocks import Blocks
from vinl.world.boxes import Boxes

_PITCH = (0.7, 1.4)
"""Distances from ring to ring [m]: a robot 0.65 m long can just stand between two, or stride over one at a time."""

_TILT = np.pi / 12
"""A tile's rings are turned by up to so much [rad]; farther, and their corners would reach into other tiles."""


def draw_hurdles(
    rng: np.random.Generator, side: float, clear: float, height: tuple[float, float], depth: float = 0.2
) -> Blocks:
    """Square rings around the origin, each of four blocks of one height, without a gap at the corners.

    Args:
        rng: the only source of chance.
        side: of the tile [m]; no block reaches beyond it.
        clear: half the side of the square in the middle that stays free [m].
        height: range of the rings' heights [m].
        depth: of the rings [m] [paper IV-A: 0.2].

    Returns:
        The blocks; none if the tile is too small for a ring.
    """
    tilt = rng.uniform(-_TILT, _TILT)
    rows = []
    for at in _places(rng, side, clear * np.sqrt(2), tilt, depth):
        high = rng.uniform(*height)
        rows += [
            [at * np.cos(turn), at * np.sin(turn), turn + np.pi / 2, 2 * at + depth, depth, high]
            for turn in tilt + np.arange(4) * np.pi / 2
        ]
    return Blocks(np.array(rows).reshape(-1, 6))


def draw_bars(
    rng: np.random.Generator, side: float, clear: float, height: tuple[float, float], depth: float = 0.2
) -> Blocks:
    """Parallel bars on both sides of the origin, each as long as the tile is wide; arguments as for ``draw_hurdles``.

    A robot that walks along them meets none; one that keeps its way across crosses each.
    """
    tilt = rng.uniform(-_TILT, _TILT)
    half = side / 2 / (np.cos(tilt) + np.sin(abs(tilt)))
    across = tilt + rng.integers(2) * np.pi / 2
    rows = [
        [sign * at * np.cos(across), sign * at * np.sin(across), across + np.pi / 2, 2 * half, depth,
         rng.uniform(*height)]
        for sign in (1, -1)
        for at in _places(rng, side, clear * np.sqrt(2), tilt, depth)
    ]  # fmt: skip
    return Blocks(np.array(rows).reshape(-1, 6))


def _places(rng: np.random.Generator, side: float, clear: float, tilt: float, depth: float) -> list[float]:
    """Distances of the middles of rings or bars from the origin [m], turned by ``tilt`` and kept to the tile.

    ``clear`` is the radius of the circle that stays free [m].
    """
    farthest = side / 2 / (np.cos(tilt) + np.sin(abs(tilt))) - depth / 2
    at, places = clear + depth / 2 + rng.uniform(0, _PITCH[0]), []
    while at <= farthest:
        places.append(at)
        at += rng.uniform(*_PITCH)
    return places


_WIDE, _TIGHT = (1.6, 2.6), (1.0, 1.8)
"""Distances of the walls of an easy and of a hard tile [m]."""

_START_SIDE = (1.4, 2.0)
"""Sides of the room in the middle [m]: a robot that starts within 0.3 m of its middle can turn on the spot there."""

_DOOR, _THICK = (0.75, 1.1), (0.08, 0.2)
"""Widths of doorways and of walls [m], as in homes."""

_OPEN, _CLOSED = 0.25, 0.4
"""Shares of the walls between two rooms that are missing, so that rooms become corridors, and that have no doorway, so
that there are corners; the room in the middle always has a way out."""

_SHORTEST = 0.1
"""Walls shorter than this are left out [m]."""


def draw_rooms(rng: np.random.Generator, side: float, difficulty: float) -> Boxes:
    """Walls of a tile around the origin, one metre high.

    Args:
        rng: random numbers.
        side: of the tile [m].
        difficulty: from 0 to 1: how near the walls are to each other.

    Returns:
        The walls: missing, with a doorway, or closed.
    """
    xs, ys = _stand_walls(rng, side, difficulty), _stand_walls(rng, side, difficulty)
    rows: list[list[float]] = []
    for turned, lines, across in ((False, ys, xs), (True, xs, ys)):
        for at in lines:
            for a, b in pairwise(across):
                # ahead of a robot that looks along x
                exit_ = bool(turned and at == xs[xs > 0].min() and a < 0 < b)
                yaw = np.pi / 2 if turned else 0.0
                for start, end in _piece_wall(rng, a, b, exit_):
                    middle = [(start + end) / 2, at][:: -1 if turned else 1]
                    rows.append([*middle, yaw, end - start, rng.uniform(*_THICK), 0.0, 1.0])
    return Boxes(np.array(rows).reshape(-1, 7))


def _stand_walls(rng: np.random.Generator, side: float, difficulty: float) -> Float[np.ndarray, " k"]:
    """Where walls stand along an axis [m]: around the middle room, then on to both sides."""
    low, high = ((1 - difficulty) * w + difficulty * t for w, t in zip(_WIDE, _TIGHT, strict=True))
    half = rng.uniform(*_START_SIDE) / 2
    ends = []
    for _ in range(2):
        at = [half]
        while True:
            further = at[-1] + rng.uniform(low, high)
            if further >= side / 2:
                break
            at.append(further)
        ends.append(np.array(at))
    return np.concatenate([-ends[0][::-1], ends[1]])


def _piece_wall(rng: np.random.Generator, a: float, b: float, passable: bool) -> list[tuple[float, float]]:
    """The pieces of a wall between two others: none, one on each side of a doorway, or all of it."""
    drawn = rng.random()
    if drawn < _OPEN:
        return []
    if drawn > 1 - _CLOSED and not passable:
        return [(a, b)]
    door = min(rng.uniform(*_DOOR), b - a)
    start = rng.uniform(a, b - door)
    return [(p, q) for p, q in ((a, start), (start + door, b)) if q - p > _SHORTEST]
