"""Where robots have been: a coarse map of each, kept up by plain tensor operations, and its neighbourhood as a robot
sees it."""

from __future__ import annotations

import torch
from jaxtyping import Bool, Float, Int
from torch import Tensor

CELLS = 32
"""Cells along a side of the map; what is farther away comes in again on the other side."""

SIDE = 1.0
"""Side of a cell [m]: robots that walk the same corridor twice find their trail."""

VIEW = 9
"""Cells along a side of what a robot sees of it, itself in the middle: 4 m to every side."""

FADE = 0.985
"""A place is forgotten by this factor at every step: half of it after 23 s."""


def blank_places(n: int, device: torch.device | str | None = None) -> Float[Tensor, "n cells"]:
    """Maps (n, ``CELLS`` squared) of robots that have been nowhere."""
    return torch.zeros(n, CELLS * CELLS, device=device)


def visit_places(
    places: Float[Tensor, "n cells"], position: Float[Tensor, "n 2"], fresh: Bool[Tensor, " n"]
) -> Float[Tensor, "n cells"]:
    """The maps after a step that ended at these positions [m]: 1 there, what was before fades; of a robot whose episode
    is fresh nothing is left."""
    kept = torch.where(fresh[:, None], 0.0, FADE * places)
    return kept.scatter(1, _find_cells(position)[:, None], 1.0)


def view_places(
    places: Float[Tensor, "n cells"], position: Float[Tensor, "n 2"], yaw: Float[Tensor, " n"]
) -> Float[Tensor, "n view"]:
    """What is around the robots, in their heading frame: (n, ``VIEW`` squared), ahead first, from left to right."""
    away = SIDE * (VIEW // 2 - torch.arange(VIEW, device=places.device, dtype=position.dtype))
    ahead, left = (part.reshape(-1) for part in torch.meshgrid(away, away, indexing="ij"))
    c, s = yaw.cos()[:, None], yaw.sin()[:, None]
    around = torch.stack([c * ahead - s * left, s * ahead + c * left], -1) + position[:, None]
    return places.gather(1, _find_cells(around))


def _find_cells(position: Float[Tensor, "*n 2"]) -> Int[Tensor, "*n"]:
    row, column = torch.floor(position / SIDE).long().remainder(CELLS).unbind(-1)
    return row * CELLS + column
