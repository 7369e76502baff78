"""The planner's loop through ``torch.compile``, held against itself: what does not compute the same is not used."""

from __future__ import annotations

import sys

import torch

from vinl.policies.grid_path import Relax, relax
from vinl.policies.occupancy_grid import SIDE


def compile_relax(robots: int, device: torch.device | str) -> Relax:
    """``relax`` for the grids of so many robots, as one kernel a step in place of eleven."""
    random = torch.Generator("cpu").manual_seed(0)
    drawn = [torch.rand(robots, SIDE, SIDE, generator=random).to(device) for _ in range(2)]
    distance, cost = 30 * drawn[0], drawn[1]
    compiled = torch.compile(relax, dynamic=False)
    with torch.no_grad():
        difference = float((compiled(distance, cost) - relax(distance, cost)).abs().max())
    if difference < 1e-4:  # not of NaN
        return compiled
    print(
        f"warning: compiled, distances differ by {difference:g} m; the planner is not compiled, which is slower",
        file=sys.stderr,
    )
    return relax
