"""Upright boxes, the one shape that walls, furniture and blocks are made of; and blocks, the clutter on the floor."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from jaxtyping import Bool, Float

from vinl.config.errors import InputError

FARTHEST = 1e6
"""No coordinate and no size is larger than this [m]; what is comes from a broken file."""


@dataclass(frozen=True, eq=False)
class Boxes:
    """Boxes that stand upright, turned about the vertical axis only.

    Attributes:
        rows: shape (n, 7), one box a row: x, y of the centre [m], yaw [rad], length along the box's own x axis [m],
            width along its own y axis [m], bottom z [m], top z [m].

    Raises:
        InputError: if the shape is wrong, a number is not finite or beyond ``FARTHEST``, or a size is not positive.
    """

    rows: Float[np.ndarray, "n 7"]
    COLUMNS: ClassVar[tuple[str, ...]] = ("x", "y", "yaw", "length", "width", "bottom", "top")

    def __post_init__(self) -> None:
        rows = np.asarray(self.rows, dtype=np.float64)
        if rows.ndim != 2 or rows.shape[1] != 7:
            raise InputError(f"boxes need shape (n, 7), got {rows.shape}")
        if not np.isfinite(rows).all():
            raise InputError("boxes hold a number that is not finite")
        if (np.abs(rows) > FARTHEST).any():
            raise InputError(f"boxes hold a number beyond {FARTHEST:g}")
        if (rows[:, 3:5] <= 0).any() or (rows[:, 6] <= rows[:, 5]).any():
            raise InputError("boxes need positive length, width and height")
        object.__setattr__(self, "rows", rows)

    def __repr__(self) -> str:
        return f"Boxes({len(self)})"

    def __len__(self) -> int:
        return len(self.rows)

    @classmethod
    def empty(cls) -> Boxes:
        """No boxes at all."""
        return cls(np.zeros((0, 7)))

    def __add__(self, other: Boxes) -> Boxes:
        return Boxes(np.concatenate([self.rows, other.rows]))

    def __getitem__(self, index) -> Boxes:
        return Boxes(np.atleast_2d(self.rows[index]))

    def below(self, height: float) -> Boxes:
        """The boxes that begin below a height [m]."""
        return self[self.rows[:, 5] < height]

    def corners(self) -> Float[np.ndarray, "n 4 2"]:
        """Corners of the footprints [m], counter-clockwise."""
        x, y, yaw, length, width = self.rows[:, :5].T
        sx, sy = np.array([1, -1, -1, 1]), np.array([1, 1, -1, -1])
        u, v = sx * length[:, None] / 2, sy * width[:, None] / 2
        c, s = np.cos(yaw)[:, None], np.sin(yaw)[:, None]
        return np.stack([x[:, None] + c * u - s * v, y[:, None] + s * u + c * v], -1)

    def contain(self, points: Float[np.ndarray, "k 2"]) -> Bool[np.ndarray, "n k"]:
        """Which box's footprint holds which point (edges included)."""
        return self._beyond(points).max(-1) <= 1e-9

    def distances(self, points: Float[np.ndarray, "k 2"]) -> Float[np.ndarray, "n k"]:
        """From each box's footprint to each point [m]; zero inside."""
        return np.hypot(*np.moveaxis(np.maximum(self._beyond(points), 0.0), -1, 0))

    def _beyond(self, points: Float[np.ndarray, "k 2"]) -> Float[np.ndarray, "n k 2"]:
        """How far points lie beyond the footprints' sides, along each box's own axes [m]; negative inside."""
        d = np.asarray(points)[None] - self.rows[:, None, :2]
        c, s = np.cos(self.rows[:, 2, None]), np.sin(self.rows[:, 2, None])
        own = np.stack([c * d[..., 0] + s * d[..., 1], -s * d[..., 0] + c * d[..., 1]], -1)
        return np.abs(own) - self.rows[:, None, 3:5] / 2


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
