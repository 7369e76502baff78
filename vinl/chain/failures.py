"""What was at fault where an episode failed: a block, a wall, or neither."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from jaxtyping import Float

from vinl.chain.contacts import KINDS
from vinl.chain.records import EpisodeRecord
from vinl.world.boxes import Blocks
from vinl.world.endings import FALL, LOOPING, STUCK, TIMEOUT
from vinl.world.free_space import FreeSpace

BLOCK, WALL, FREE = "block", "wall", "free"
CAUSES = (BLOCK, WALL, FREE)
"""Furniture counts as wall. ``free``: neither was touched or near."""

FALL_WINDOW = 1.0
"""What a robot touched in so many last seconds [s] is what it fell over."""

NEAR = 0.5
"""A block or a wall within this distance of the trunk's middle [m] is near: the robot is 0.65 m long."""

FAILURES = (
    *((FALL, cause, f"fell, {text}") for cause, text in ((BLOCK, "on a block"), (WALL, "at a wall"), (FREE, "free"))),
    *((STUCK, cause, f"stuck {text}") for cause, text in ((BLOCK, "on a block"), (WALL, "at a wall"), (FREE, "free"))),
    (LOOPING, "", "looping"),
    (TIMEOUT, "", "out of time"),
)
"""Every kind of failure: end reason, cause, and its title in the tables."""


def find_cause(
    at: Float[np.ndarray, "2"], touches: Float[np.ndarray, "m 4"], since: float, space: FreeSpace, blocks: Blocks
) -> str:
    """Block, wall or neither.

    What was touched in more control steps counts; what was not touched, but is nearest and near, counts otherwise: a
    navigator may stand before a wall for ever without touching it.

    Args:
        at: where the episode ended [m].
        touches: as in ``EpisodeTrace.contacts``.
        since: time from which touches count [s].
        space: of the floor plan.
        blocks: the clutter.
    """
    late = touches[touches[:, 0] > since + 1e-9]
    on_block = np.array([name.endswith(BLOCK) for name in KINDS])[late[:, 1].astype(int)]
    steps = {BLOCK: len(np.unique(late[on_block, 0])), WALL: len(np.unique(late[~on_block, 0]))}
    if any(steps.values()):
        return max(steps, key=lambda cause: steps[cause])
    row, column = space.plan.frame.cell(at)
    inside = 0 <= row < space.clearance.shape[0] and 0 <= column < space.clearance.shape[1]
    away = {BLOCK: measure_distance(at, blocks), WALL: float(space.clearance[row, column]) if inside else 0.0}
    nearest = min(away, key=lambda cause: away[cause])
    return nearest if away[nearest] <= NEAR else FREE


def measure_distance(at: Float[np.ndarray, "2"], blocks: Blocks) -> float:
    """From a point to the nearest block's footprint [m]; infinite without blocks."""
    if not len(blocks):
        return float("inf")
    return float(blocks.boxes().distances(at[None]).min())


def count_failures(records: Sequence[EpisodeRecord]) -> dict[str, Any]:
    """How many episodes failed in each way: by cause for falls and robots that were stuck."""
    counts: dict[str, Any] = {FALL: dict.fromkeys(CAUSES, 0), STUCK: dict.fromkeys(CAUSES, 0), LOOPING: 0, TIMEOUT: 0}
    for record in records:
        if record.end_reason in (FALL, STUCK):
            counts[record.end_reason][record.end_at or FREE] += 1
        elif not record.success:
            counts[record.end_reason] += 1
    return counts


def read_failure(counts: dict[str, Any], reason: str, cause: str) -> int:
    """One of the numbers that ``count_failures`` returned."""
    return counts[reason][cause] if cause else counts[reason]
