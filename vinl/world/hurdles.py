"""Training tiles that nobody can walk around: closed rings of blocks, and bars from side to side."""

from __future__ import annotations

import numpy as np

from vinl.world.blocks import Blocks

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
