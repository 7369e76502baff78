"""``spread`` as one Triton kernel: a block of threads for each grid sweeps over its rows and columns, to and fro, until
no distance becomes shorter [Zhao 2005]. Seven pairs of sweeps do what takes a hundred steps of all cells at once."""

# pyright: reportMissingImports=false, reportUnknownMemberType=false
from __future__ import annotations

import torch
import triton
import triton.language as tl
from jaxtyping import Float
from torch import Tensor

from vinl.policies.grid_path import FAR

_ROUNDS = 40
"""So many times over rows and columns at most; mazes of homes take five."""


@triton.jit
def _sweep(
    distance,
    cost,
    ACROSS: tl.constexpr,
    ALONG: tl.constexpr,
    FORWARD: tl.constexpr,
    SIDE: tl.constexpr,
    LANES: tl.constexpr,
    FAR: tl.constexpr,
):
    lane = tl.arange(0, LANES)
    inside = lane < SIDE
    shorter = tl.zeros([LANES], tl.float32)
    for k in range(1, SIDE):
        here = (k if FORWARD else SIDE - 1 - k) * ACROSS + lane * ALONG
        behind = here - ACROSS if FORWARD else here + ACROSS
        straight = tl.load(distance + behind, inside, FAR)
        left = tl.load(distance + behind - ALONG, inside & (lane > 0), FAR)
        right = tl.load(distance + behind + ALONG, lane < SIDE - 1, FAR)
        crossed = tl.load(cost + here, inside, 0.0)
        before = tl.load(distance + here, inside, FAR)
        oblique = tl.minimum(left, right) + crossed * 1.4142135623730951
        after = tl.minimum(before, tl.minimum(straight + crossed, oblique))
        tl.store(distance + here, after, inside)
        shorter = tl.maximum(shorter, before - after)
        tl.debug_barrier()  # the next line reads what other threads of the block wrote
    return shorter


@triton.jit
def _spread(distance, cost, SIDE: tl.constexpr, LANES: tl.constexpr, ROUNDS: tl.constexpr, FAR: tl.constexpr):
    distance += tl.program_id(0) * SIDE * SIDE
    cost += tl.program_id(0) * SIDE * SIDE
    rounds = 0
    going = True
    while going:
        down = _sweep(distance, cost, SIDE, 1, True, SIDE, LANES, FAR)
        up = _sweep(distance, cost, SIDE, 1, False, SIDE, LANES, FAR)
        right = _sweep(distance, cost, 1, SIDE, True, SIDE, LANES, FAR)
        left = _sweep(distance, cost, 1, SIDE, False, SIDE, LANES, FAR)
        shorter = tl.maximum(tl.maximum(down, up), tl.maximum(right, left))
        rounds += 1
        going = (tl.max(shorter) > 0) & (rounds < ROUNDS)


def spread_in_blocks(
    distance: Float[Tensor, "n side side"], cost: Float[Tensor, "n side side"]
) -> Float[Tensor, "n side side"]:
    """See ``vinl.policies.grid_path.spread``, which stops at paths of 19 m; on a GPU only."""
    distance, side = distance.clone(memory_format=torch.contiguous_format), distance.shape[-1]
    lanes = triton.next_power_of_2(side)
    _spread[(len(distance),)](  # pyright: ignore[reportIndexIssue]
        distance, cost.contiguous(), SIDE=side, LANES=lanes, ROUNDS=_ROUNDS, FAR=FAR, num_warps=lanes // 32
    )
    return distance
