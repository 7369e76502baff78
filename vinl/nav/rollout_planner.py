"""The occupancy grids of all robots of a training, and the paths on them, step by step along its roll-outs."""

from __future__ import annotations

import sys
from collections.abc import Callable

import torch
from jaxtyping import Bool, Float
from torch import Tensor

from vinl.policies.depth_memory import State
from vinl.policies.grid_path import FAR, Spread, spread
from vinl.policies.nav_actor import NavActor
from vinl.policies.occupancy_grid import CELL, SIDE
from vinl.rl.step_graph import StepGraph

_ALIKE, _RARE = 1e-3, 0.02
"""Plans that differ by less are alike; a fraction of the robots in which they may not be, for where a point lies on the
edge between two cells, the last bit decides."""


class RolloutPlanner:
    """Runs ``NavActor.plan`` for n robots, on a GPU as one CUDA graph.

    Args:
        actor: whose grid and path it is.
        fast: whether it is compiled, with the path's loop as one kernel (GPU only).

    Attributes:
        grid: the robots' grids before the present step; stays where it is.
    """

    def __init__(self, actor: NavActor, robots: int, device: torch.device, fast: bool) -> None:
        assert actor.image is not None
        self.grid = actor.initial_grid(robots, device)
        self._next = tuple(torch.zeros_like(part) for part in self.grid)
        self._depth = torch.zeros(robots, *actor.image, device=device)
        self._vector = torch.zeros(robots, actor.observation_size, device=device)
        self._fresh = torch.ones(robots, dtype=torch.bool, device=device)
        self._planned = torch.zeros(robots, actor.input_size, device=device)
        self._graph = StepGraph(self._step) if device.type == "cuda" else None
        self._unused = torch.zeros(1, dtype=torch.long, device=device)
        self._plan = fast_plan(actor, robots, device) if fast else actor.plan

    def plan(
        self, depth: Float[Tensor, "n height width"], vector: Float[Tensor, "n k"], fresh: Bool[Tensor, " n"]
    ) -> Float[Tensor, "n input"]:
        """See ``NavActor.plan``; good until the next call. The grids stay as they are until ``go_on``."""
        self._depth.copy_(depth)
        self._vector.copy_(vector)
        self._fresh.copy_(fresh)
        if self._graph is None:
            self._step(self._unused)
        else:
            self._graph.run(self._unused)
        return self._planned

    def go_on(self) -> None:
        """The step that was planned is made."""
        for part, now in zip(self.grid, self._next, strict=True):
            part.copy_(now)

    def _step(self, unused: Tensor) -> None:
        planned, grid = self._plan(self._depth, self._vector, self.grid, self._fresh)
        self._planned.copy_(planned)
        for part, now in zip(self._next, grid, strict=True):
            part.copy_(now)


Plan = Callable[[Tensor, Tensor, State, Tensor], tuple[Tensor, State]]


def fast_plan(actor: NavActor, robots: int, device: torch.device) -> Plan:
    """``actor.plan`` through ``torch.compile``, held against itself: what does not compute the same is not used.
    Uncompiled these are 670 small kernels, many of which read whole grids."""
    assert actor.image is not None
    actor.spreading = fast_spread(device)
    compiled = torch.compile(actor.plan, dynamic=False)
    random = torch.Generator("cpu").manual_seed(0)
    pose, cells, bumps = actor.initial_grid(robots, device)
    cells.copy_(torch.rand(cells.shape, generator=random) < 0.1)
    depth = torch.rand(robots, *actor.image, generator=random).to(device)
    vector = torch.randn(robots, actor.observation_size, generator=random).to(device)
    fresh = torch.zeros(robots, dtype=torch.bool, device=device)
    with torch.inference_mode():  # as in roll-outs: otherwise it would be compiled once more
        planned, found = (plan(depth, vector, (pose, cells, bumps), fresh)[0] for plan in (actor.plan, compiled))
        alike = float(((planned - found).abs().amax(1) < _ALIKE).float().mean())
    if alike > 1 - _RARE:  # not of NaN
        return compiled
    print(f"warning: compiled, {1 - alike:.0%} of the robots have another plan; it is not used", file=sys.stderr)
    return actor.plan


def fast_spread(device: torch.device) -> Spread:
    """``spread`` as one kernel, held against itself: what does not compute the same is not used."""
    from vinl.nav.grid_kernel import spread_in_blocks  # Triton

    random = torch.Generator("cpu").manual_seed(0)
    walls = torch.rand(8, SIDE, SIDE, generator=random) < 0.2
    cost = torch.where(walls, 20.0, CELL).to(device)
    distance = torch.full_like(cost, FAR)
    distance[:, SIDE // 3, SIDE // 2] = 0.0
    difference = float((spread_in_blocks(distance, cost) - spread(distance, cost)).abs().max())
    if difference < 1e-3:  # not of NaN
        return spread_in_blocks
    print(f"warning: paths of the kernel differ by {difference:g} m; it is not used, which is slower", file=sys.stderr)
    return spread
