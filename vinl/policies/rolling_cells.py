"""Cells that do not move and go with the robot all the same: those that it leaves behind stand for ground ahead."""

from __future__ import annotations

import torch
from jaxtyping import Bool, Float
from torch import Tensor


def place_cells(cell: Tensor, side: int) -> Tensor:
    """Which column and row of the plane each of the ``side`` columns and rows stands for, (n, 2, side), with the robot
    in the cell (n, 2), whole numbers of either type."""
    half = side // 2
    return cell[..., None] + (torch.arange(side, device=cell.device) - cell[..., None] + half).remainder(side) - half


def find_stale(before: Tensor, after: Tensor, side: int) -> Bool[Tensor, "n side side"]:
    """Cells that stand for other ground once the robot went from one cell (n, 2) to another."""
    stale = place_cells(before, side) != place_cells(after, side)
    return stale[:, 0, :, None] | stale[:, 1, None, :]


def turned(angle: Float[Tensor, "..."], x: Float[Tensor, "..."], y: Float[Tensor, "..."]) -> tuple[Tensor, Tensor]:
    """Points of the heading frame in the axes of the cells."""
    c, s = torch.cos(angle), torch.sin(angle)
    return c * x - s * y, s * x + c * y
