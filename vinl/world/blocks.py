"""Blocks: the clutter on the floor. One row a block; height field, collision boxes, mesh and drawing derive from it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from jaxtyping import Float

from vinl.config.errors import InputError
from vinl.world.boxes import Boxes


@dataclass(frozen=True, eq=False)
class Blocks:
    """Blocks that lie on the floor z = 0.

    Attributes:
        rows: shape (n, 6), one block a row: x, y of the centre [m], yaw [rad], length [m], width [m], height [m].

    Raises:
        InputError: if the shape is wrong, a number is not finite, or a size is not positive.
    """

    rows: Float[np.ndarray, "n 6"]
    COLUMNS: ClassVar[tuple[str, ...]] = ("x", "y", "yaw", "length", "width", "height")

    def __post_init__(self) -> None:
        rows = np.asarray(self.rows, dtype=np.float64)
        if rows.ndim != 2 or rows.shape[1] != 6:
            raise InputError(f"blocks need shape (n, 6), got {rows.shape}")
        if not np.isfinite(rows).all():
            raise InputError("blocks hold a number that is not finite")
        if (rows[:, 3:] <= 0).any():
            raise InputError("blocks need positive length, width and height")
        object.__setattr__(self, "rows", rows)

    def __repr__(self) -> str:
        return f"Blocks({len(self)})"

    def __len__(self) -> int:
        return len(self.rows)

    @classmethod
    def empty(cls) -> Blocks:
        """No blocks at all."""
        return cls(np.zeros((0, 6)))

    def __add__(self, other: Blocks) -> Blocks:
        return Blocks(np.concatenate([self.rows, other.rows]))

    def boxes(self) -> Boxes:
        """The same blocks as boxes that stand on the floor."""
        return Boxes(np.column_stack([self.rows[:, :5], np.zeros(len(self)), self.rows[:, 5]]))
