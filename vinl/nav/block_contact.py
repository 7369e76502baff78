"""Which robots stand above a block: in the kinematic environment nothing stops them there, but a reward can see it."""

from __future__ import annotations

import numpy as np
import torch
from jaxtyping import Bool, Float, Int
from torch import Tensor

from vinl.robot.aliengo import WIDTH

_FAR = 1e6
"""Where blocks lie that are none [m]."""


class BlockTable:
    """The blocks of all homes in one tensor, as many rows for each home as the one with the most blocks needs.

    Args:
        most: blocks of one home at most; ``reserve`` makes room for more.
        slots: homes.
        device: torch device.
    """

    def __init__(self, most: int, slots: int, device: torch.device) -> None:
        self._rows = torch.zeros(slots, most, 6, device=device)  # x, y, cos and sin of the yaw, half length, half width
        self._rows[..., 0] = _FAR

    @property
    def most(self) -> int:
        """Rows of each home."""
        return self._rows.shape[1]

    def reserve(self, most: int) -> None:
        """Make room for homes of so many blocks, if there is none yet."""
        if most > self.most:
            more = torch.zeros(len(self._rows), most - self.most, 6, device=self._rows.device)
            more[..., 0] = _FAR
            self._rows = torch.cat([self._rows, more], 1)

    @property
    def bytes(self) -> int:
        """Device memory."""
        return self._rows.numel() * self._rows.element_size()

    def encode(self, blocks: Float[np.ndarray, "m 6"]) -> Float[np.ndarray, "most 6"]:
        """The rows of a home of at most ``most`` blocks (x, y, yaw, length, width, height), for ``rows``."""
        rows = np.zeros((self.most, 6), np.float32)
        rows[:, 0] = _FAR
        x, y, yaw, length, width, _ = blocks.T
        rows[: len(blocks)] = np.stack([x, y, np.cos(yaw), np.sin(yaw), length / 2, width / 2], 1)
        return rows

    def rows(self, slot: int) -> Float[Tensor, "most 6"]:
        """A home's rows, to be written."""
        return self._rows[slot]

    def find_above(
        self, home: Int[Tensor, " n"], position: Float[Tensor, "n 2"], yaw: Float[Tensor, " n"], length: float
    ) -> Bool[Tensor, " n"]:
        """Which robots overlap a block, as rectangles of ``length`` x ``WIDTH``: as wide as over the feet, not as the
        trunk, which is what meets walls. Exact, by separating axes."""
        x, y, cos, sin, half_length, half_width = self._rows[home.long()].unbind(-1)
        x, y = x - position[:, :1], y - position[:, 1:]
        own_cos, own_sin = yaw.cos()[:, None], yaw.sin()[:, None]
        ahead, aside = x * own_cos + y * own_sin, y * own_cos - x * own_sin
        between = (cos * own_cos + sin * own_sin).abs(), (sin * own_cos - cos * own_sin).abs()
        mine = length / 2, WIDTH / 2
        apart = ahead.abs() > mine[0] + half_length * between[0] + half_width * between[1]
        apart |= aside.abs() > mine[1] + half_length * between[1] + half_width * between[0]
        apart |= (x * cos + y * sin).abs() > half_length + mine[0] * between[0] + mine[1] * between[1]
        apart |= (y * cos - x * sin).abs() > half_width + mine[0] * between[1] + mine[1] * between[0]
        return (~apart).any(1)
