"""``relax`` as one Triton kernel: a block of threads for each grid, which stays in its cache for all steps. On an H200
eight steps of 4,096 grids take 0.6 ms; compiled by torch, which reads all grids anew for each step, 2.5 ms."""

# pyright: reportMissingImports=false, reportUnknownMemberType=false
from __future__ import annotations

import torch
import triton
import triton.language as tl
from jaxtyping import Float
from torch import Tensor

from vinl.policies.grid_path import FAR, STEPS

_WARPS = 32
"""Of a block: with fewer, more grids share a processor than its cache holds."""


@triton.jit
def _relax(given, cost, buffers, size, SIDE: tl.constexpr, STEPS: tl.constexpr, BLOCK: tl.constexpr, FAR: tl.constexpr):
    grid = tl.program_id(0) * SIDE * SIDE
    source = given + grid
    for step in range(STEPS):
        target = buffers + (step % 2) * size + grid
        for start in range(0, SIDE * SIDE, BLOCK):
            at = start + tl.arange(0, BLOCK)
            row, column = at // SIDE, at % SIDE
            inside = at < SIDE * SIDE
            up, down = inside & (row > 0), inside & (row < SIDE - 1)
            left, right = inside & (column > 0), inside & (column < SIDE - 1)
            here = source + at
            straight = tl.minimum(
                tl.minimum(tl.load(here - SIDE, up, FAR), tl.load(here + SIDE, down, FAR)),
                tl.minimum(tl.load(here - 1, left, FAR), tl.load(here + 1, right, FAR)),
            )
            oblique = tl.minimum(
                tl.minimum(tl.load(here - SIDE - 1, up & left, FAR), tl.load(here - SIDE + 1, up & right, FAR)),
                tl.minimum(tl.load(here + SIDE - 1, down & left, FAR), tl.load(here + SIDE + 1, down & right, FAR)),
            )
            crossed = tl.load(cost + grid + at, inside, 0.0)
            better = tl.minimum(straight + crossed, oblique + crossed * 1.4142135623730951)
            tl.store(target + at, tl.minimum(tl.load(here, inside, FAR), better), inside)
        tl.debug_barrier()  # the next step reads what other threads of the block wrote
        source = target


def relax_in_blocks(
    distance: Float[Tensor, "n side side"], cost: Float[Tensor, "n side side"]
) -> Float[Tensor, "n side side"]:
    """See ``vinl.policies.grid_path.relax``; on a GPU only."""
    n, side = len(distance), distance.shape[-1]
    buffers = torch.empty(2, *distance.shape, device=distance.device)
    _relax[(n,)](  # pyright: ignore[reportIndexIssue]
        distance.contiguous(),
        cost.contiguous(),
        buffers,
        distance.numel(),
        SIDE=side,
        STEPS=STEPS,
        BLOCK=1024,
        FAR=FAR,
        num_warps=_WARPS,
        num_stages=1,
    )
    return buffers[(STEPS - 1) % 2]
