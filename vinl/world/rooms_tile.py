"""A training tile of small rooms and corridors: corners to turn in, doorways, and no room to keep away from walls."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from jaxtyping import Float

from vinl.world.blocks import Blocks
from vinl.world.boxes import Boxes

_WIDE, _TIGHT = (1.6, 2.6), (1.0, 1.8)
"""Distances of the walls of an easy and of a hard tile [m]."""

_ALLEY = (0.5, 0.8)
"""Widths of alleys, walls not taken off [m]: a robot 0.38 m wide over its legs walks through most and turns in none."""

_START_SIDE = (1.4, 2.0)
"""Sides of the room in the middle [m]: a robot that starts within 0.3 m of its middle can turn on the spot there."""

_DOOR, _THICK = (0.75, 1.1), (0.08, 0.2)
"""Widths of doorways and of walls [m], as in homes."""

_OPEN, _CLOSED = 0.25, 0.4
"""Shares of the walls between two rooms that are missing, so that rooms become corridors, and that have no doorway, so
that there are corners; the room in the middle always has a way out."""

_SHORTEST = 0.1
"""Walls shorter than this are left out [m]."""


_ASKEW, _BESIDE = np.pi / 6, 0.15
"""A block in a doorway is turned against the wall by up to so much [rad], and lies so far off its line at most [m]."""


@dataclass(frozen=True, eq=False)
class Rooms:
    """What a tile of rooms is made of.

    Attributes:
        walls: one metre high.
        doors: (k, 4) doorways: x, y of the middle [m], yaw of the wall [rad] and width [m].
    """

    walls: Boxes
    doors: Float[np.ndarray, "k 4"]


def draw_rooms(rng: np.random.Generator, side: float, difficulty: float, alleys: float = 0.0) -> Rooms:
    """Walls of a tile around the origin.

    Args:
        rng: random numbers.
        side: of the tile [m].
        difficulty: from 0 to 1: how near the walls are to each other.
        alleys: share of the spaces between walls that are alleys, whatever the difficulty: as between a bed and a wall.

    Returns:
        The walls: missing, with a doorway, or closed.
    """
    xs, ys = _cut(rng, side, difficulty, alleys), _cut(rng, side, difficulty, alleys)
    rows: list[list[float]] = []
    doors: list[list[float]] = []
    for turned, lines, across in ((False, ys, xs), (True, xs, ys)):
        for at in lines:
            for a, b in pairwise(across):
                # ahead of a robot that looks along x
                exit_ = bool(turned and at == xs[xs > 0].min() and a < 0 < b)
                yaw = np.pi / 2 if turned else 0.0
                pieces, door = _wall(rng, a, b, exit_)
                if door is not None:
                    doors.append([*[sum(door) / 2, at][:: -1 if turned else 1], yaw, door[1] - door[0]])
                for start, end in pieces:
                    middle = [(start + end) / 2, at][:: -1 if turned else 1]
                    rows.append([*middle, yaw, end - start, rng.uniform(*_THICK), 0.0, 1.0])
    return Rooms(Boxes(np.array(rows).reshape(-1, 7)), np.array(doors).reshape(-1, 4))


def block_doors(
    rng: np.random.Generator, doors: Float[np.ndarray, "k 4"], share: float, height: tuple[float, float]
) -> Blocks:
    """Blocks across doorways: no way around them, and walls on both sides.

    Args:
        rng: the only source of chance.
        doors: doorways as in ``Rooms``.
        share: of the doorways that get a block.
        height: range of the blocks' heights [m].

    Returns:
        Blocks of 0.2-0.5 x 0.2 m [paper IV-A] that lie about along the wall, not longer than the doorway is wide.
    """
    x, y, yaw, width = doors[rng.random(len(doors)) < share].T
    n = len(x)
    length = np.minimum(rng.uniform(0.2, 0.5, n), width)
    along = rng.uniform(-0.5, 0.5, n) * (width - length)
    across = rng.uniform(-_BESIDE, _BESIDE, n)
    centre = np.column_stack(
        [x + along * np.cos(yaw) - across * np.sin(yaw), y + along * np.sin(yaw) + across * np.cos(yaw)]
    )
    turned = yaw + rng.uniform(-_ASKEW, _ASKEW, n)
    return Blocks(np.column_stack([centre, turned, length, np.full(n, 0.2), rng.uniform(*height, n)]))


def _cut(rng: np.random.Generator, side: float, difficulty: float, alleys: float) -> Float[np.ndarray, " k"]:
    """Where walls stand along an axis [m]: around the middle room, then on to both sides."""
    low, high = ((1 - difficulty) * w + difficulty * t for w, t in zip(_WIDE, _TIGHT, strict=True))
    half = rng.uniform(*_START_SIDE) / 2
    ends = []
    for _ in range(2):
        at = [half]
        while True:
            alley = alleys > 0 and rng.random() < alleys
            further = at[-1] + rng.uniform(*(_ALLEY if alley else (low, high)))
            if further >= side / 2:
                break
            at.append(further)
        ends.append(np.array(at))
    return np.concatenate([-ends[0][::-1], ends[1]])


def _wall(
    rng: np.random.Generator, a: float, b: float, passable: bool
) -> tuple[list[tuple[float, float]], tuple[float, float] | None]:
    """The pieces of a wall between two others: none, one on each side of a doorway, or all of it; and the doorway."""
    drawn = rng.random()
    if drawn < _OPEN:
        return [], None
    if drawn > 1 - _CLOSED and not passable:
        return [(a, b)], None
    door = min(rng.uniform(*_DOOR), b - a)
    start = rng.uniform(a, b - door)
    pieces = [(p, q) for p, q in ((a, start), (start + door, b)) if q - p > _SHORTEST]
    return pieces, (start, start + door)
