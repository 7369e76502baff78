"""Litter: what lies about in a home, toys, shoes and books, as small boxes."""

from __future__ import annotations

import numpy as np

from vinl.world.blocks import Blocks

SIDE = (0.05, 0.15)
"""Range of both sides of an object [m]."""

HEIGHT = (0.03, 0.10)
"""Range of its height [m]."""


def draw_litter(rng: np.random.Generator, density: float, half: float) -> Blocks:
    """Objects at random places of the square |x|, |y| <= half, with any yaw; they may lie on one another.

    Args:
        rng: the only source of chance.
        density: objects per m2.
        half: half the side of the square [m].
    """
    n = round(density * (2 * half) ** 2)
    places, yaw = rng.uniform(-half, half, (n, 2)), rng.uniform(0, np.pi, n)
    return Blocks(np.column_stack([places, yaw, rng.uniform(*SIDE, (n, 2)), rng.uniform(*HEIGHT, n)]))
