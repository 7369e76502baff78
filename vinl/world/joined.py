"""Blocks that lie against others: end to end, at an angle, side by side, or in long rows."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from vinl.world.blocks import Blocks

_WAYS = (0.4, 0.4, 0.2)
"""How often blocks lie end to end, at an angle, side by side (0.4 m deep then, a long step)."""

_ANGLES = (np.pi / 6, np.pi / 2)
"""Range of the angle between two blocks that form a corner [rad]."""


def join_blocks(rng: np.random.Generator, blocks: Blocks, share: float) -> Blocks:
    """Lay a second block against some of the blocks.

    Args:
        rng: the only source of chance.
        blocks: what lies there.
        share: probability of each block to get a partner.

    Returns:
        The partners alone: their yaw and place follow from the first block, length and height are a block's own.
    """
    first = blocks.rows[rng.random(len(blocks)) < share]
    n = len(first)
    x, y, yaw, length, width, height = first.T
    own = rng.permutation(first[:, 3]), rng.permutation(height)
    way, side = rng.choice(3, n, p=_WAYS), rng.choice([-1.0, 1.0], n)
    turned = yaw + np.where(way == 1, side * rng.uniform(*_ANGLES, n), 0.0)
    end = _turn(np.column_stack([length / 2, np.zeros(n)]), yaw) * side[:, None]
    beyond = _turn(np.column_stack([own[0] / 2, np.zeros(n)]), turned) * side[:, None]
    beside = _turn(np.column_stack([np.zeros(n), width * side]), yaw)
    centre = np.column_stack([x, y]) + np.where((way == 2)[:, None], beside, end + beyond)
    return Blocks(np.column_stack([centre, turned, own[0], width, own[1]]))


def draw_rows(
    rng: np.random.Generator,
    centres: Float[np.ndarray, "n 2"],
    length: tuple[float, float],
    height: tuple[float, float],
) -> Blocks:
    """Rows of blocks, 0.2 m deep, one height and any yaw each: too long to walk around, one has to step over them.

    Args:
        rng: the only source of chance.
        centres: where [m].
        length: range of the rows' lengths [m].
        height: range of their heights [m].
    """
    n = len(centres)
    yaw, long, high = rng.uniform(0, np.pi, n), rng.uniform(*length, n), rng.uniform(*height, n)
    return Blocks(np.column_stack([centres, yaw, long, np.full(n, 0.2), high]))


def joined_share(share: float) -> float:
    """Probability of a partner for each single block, so that ``share`` of all blocks lie against another."""
    return share / (2 - share)


def _turn(vector: Float[np.ndarray, "n 2"], angle: Float[np.ndarray, " n"]) -> Float[np.ndarray, "n 2"]:
    c, s = np.cos(angle), np.sin(angle)
    return np.column_stack([c * vector[:, 0] - s * vector[:, 1], s * vector[:, 0] + c * vector[:, 1]])
