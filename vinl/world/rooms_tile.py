"""A training tile of small rooms and corridors: corners to turn in, doorways, and no room to keep away from walls."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from jaxtyping import Float

from vinl.world.boxes import Boxes

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
    xs, ys = _cut(rng, side, difficulty), _cut(rng, side, difficulty)
    rows: list[list[float]] = []
    for turned, lines, across in ((False, ys, xs), (True, xs, ys)):
        for at in lines:
            for a, b in pairwise(across):
                # ahead of a robot that looks along x
                exit_ = bool(turned and at == xs[xs > 0].min() and a < 0 < b)
                yaw = np.pi / 2 if turned else 0.0
                for start, end in _wall(rng, a, b, exit_):
                    middle = [(start + end) / 2, at][:: -1 if turned else 1]
                    rows.append([*middle, yaw, end - start, rng.uniform(*_THICK), 0.0, 1.0])
    return Boxes(np.array(rows).reshape(-1, 7))


def _cut(rng: np.random.Generator, side: float, difficulty: float) -> Float[np.ndarray, " k"]:
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


def _wall(rng: np.random.Generator, a: float, b: float, passable: bool) -> list[tuple[float, float]]:
    """The pieces of a wall between two others: none, one on each side of a doorway, or all of it."""
    drawn = rng.random()
    if drawn < _OPEN:
        return []
    if drawn > 1 - _CLOSED and not passable:
        return [(a, b)]
    door = min(rng.uniform(*_DOOR), b - a)
    start = rng.uniform(a, b - door)
    return [(p, q) for p, q in ((a, start), (start + door, b)) if q - p > _SHORTEST]
