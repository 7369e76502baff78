"""Upright boxes, the one shape that walls, furniture and blocks are made of; and blocks, the clutter on the floor."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar, TypeVar

import numpy as np
from jaxtyping import Bool, Float

from vinl.config.errors import InputError

T = TypeVar("T", bound="_Table")

FARTHEST = 1e6
"""No coordinate and no size is larger than this [m]; what is comes from a broken file."""


@dataclass(frozen=True, eq=False, repr=False)
class _Table(ABC):
    """A thing a row, in columns that ``WIDTH`` counts; refuses rows that no thing can have."""

    rows: Float[np.ndarray, "n k"]
    WIDTH: ClassVar[int]

    def __post_init__(self) -> None:
        name, rows = type(self).__name__.lower(), np.asarray(self.rows, dtype=np.float64)
        if rows.ndim != 2 or rows.shape[1] != self.WIDTH:
            raise InputError(f"{name} need shape (n, {self.WIDTH}), got {rows.shape}")
        if not np.isfinite(rows).all():
            raise InputError(f"{name} hold a number that is not finite")
        if (np.abs(rows) > FARTHEST).any():
            raise InputError(f"{name} hold a number beyond {FARTHEST:g}")
        if not all((size > 0).all() for size in self._sizes(rows)):
            raise InputError(f"{name} need positive length, width and height")
        object.__setattr__(self, "rows", rows)

    def __repr__(self) -> str:
        return f"{type(self).__name__}({len(self)})"

    def __len__(self) -> int:
        return len(self.rows)

    @classmethod
    def empty(cls: type[T]) -> T:
        """None at all."""
        return cls(np.zeros((0, cls.WIDTH)))

    def __add__(self: T, other: T) -> T:
        return type(self)(np.concatenate([self.rows, other.rows]))

    @staticmethod
    @abstractmethod
    def _sizes(rows: np.ndarray) -> tuple[np.ndarray, ...]:
        """Length, width and height [m]."""


@dataclass(frozen=True, eq=False, repr=False)
class Boxes(_Table):
    """Boxes that stand upright, turned about the vertical axis only, one a row: x, y of the centre [m], yaw [rad],
    length along the box's own x axis [m], width along its own y axis [m], bottom z [m], top z [m].

    Raises ``InputError`` if the shape is wrong, a number is not finite or beyond ``FARTHEST``, or a size is not
    positive.
    """

    WIDTH: ClassVar[int] = 7

    @staticmethod
    def _sizes(rows: np.ndarray) -> tuple[np.ndarray, ...]:
        return rows[:, 3], rows[:, 4], rows[:, 6] - rows[:, 5]

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
        return self.beyond(points).max(-1) <= 1e-9

    def distances(self, points: Float[np.ndarray, "k 2"]) -> Float[np.ndarray, "n k"]:
        """From each box's footprint to each point [m]; zero inside."""
        return np.hypot(*np.moveaxis(np.maximum(self.beyond(points), 0.0), -1, 0))

    def beyond(self, points: Float[np.ndarray, "k 2"]) -> Float[np.ndarray, "n k 2"]:
        """How far points lie beyond the footprints' sides, along each box's own axes [m]; negative inside."""
        d = np.asarray(points)[None] - self.rows[:, None, :2]
        c, s = np.cos(self.rows[:, 2, None]), np.sin(self.rows[:, 2, None])
        own = np.stack([c * d[..., 0] + s * d[..., 1], -s * d[..., 0] + c * d[..., 1]], -1)
        return np.abs(own) - self.rows[:, None, 3:5] / 2


@dataclass(frozen=True, eq=False, repr=False)
class Blocks(_Table):
    """Blocks that lie on the floor z = 0, one a row: x, y of the centre [m], yaw [rad], length, width, height [m].
    Height field, collision boxes, mesh and drawing derive from them. Raises ``InputError`` as ``Boxes`` do."""

    WIDTH: ClassVar[int] = 6

    @staticmethod
    def _sizes(rows: np.ndarray) -> tuple[np.ndarray, ...]:
        return rows[:, 3], rows[:, 4], rows[:, 5]

    def boxes(self) -> Boxes:
        """The same blocks as boxes that stand on the floor."""
        return Boxes(np.column_stack([self.rows[:, :5], np.zeros(len(self)), self.rows[:, 5]]))
