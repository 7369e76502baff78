"""A training tile of rings of blocks, one around the other: whichever way a robot walks, it has to step over them."""

from __future__ import annotations

import numpy as np

from vinl.world.blocks import Blocks

_PITCH = (0.7, 1.4)
"""Distances from ring to ring [m]: a robot 0.65 m long can just stand between two, or stride over one at a time."""

_DEPTH = 0.2
"""Of a block [m] [paper IV-A]."""

_TILT = np.pi / 12
"""A tile's rings are turned by up to so much [rad]; farther, and their corners would reach into other tiles."""


def draw_hurdles(rng: np.random.Generator, side: float, clear: float, height: tuple[float, float]) -> Blocks:
    """Square rings around the origin, each of four blocks of one height, without a gap at the corners.

    Args:
        rng: the only source of chance.
        side: of the tile [m]; no block reaches beyond it.
        clear: half the side of the square in the middle that stays free [m].
        height: range of the rings' heights [m].

    Returns:
        The blocks; none if the tile is too small for a ring.
    """
    tilt = rng.uniform(-_TILT, _TILT)
    farthest = side / 2 / (np.cos(tilt) + np.sin(abs(tilt))) - _DEPTH / 2
    # turned, the near side of a ring comes no nearer to the middle than a circle around the free square's corners
    at = clear * np.sqrt(2) + _DEPTH / 2 + rng.uniform(0, _PITCH[0])
    rows = []
    while at <= farthest:
        high = rng.uniform(*height)
        rows += [
            [at * np.cos(turn), at * np.sin(turn), turn + np.pi / 2, 2 * at + _DEPTH, _DEPTH, high]
            for turn in tilt + np.arange(4) * np.pi / 2
        ]
        at += rng.uniform(*_PITCH)
    return Blocks(np.array(rows).reshape(-1, 6))
