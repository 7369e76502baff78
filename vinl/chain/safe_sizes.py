"""How many robots a network may be asked for in one call, so that each gets the same answer as in any other call."""

from __future__ import annotations

import weakref
from collections.abc import Sequence
from typing import Any, cast

import torch
from torch import Tensor

from vinl.policies.depth_policy import DepthNetwork
from vinl.policies.networks import PolicyNetwork

BATCH = 8
"""Robots in a call whose answers all others are held to: published figures were made with calls of this size."""

CANDIDATES = (4, 6, 8, 12, 16, 20, 24)
"""Sizes that are tried, ascending. Fewer than four rows go another way through the libraries."""

_ROWS = 24
"""Robots that the check makes up: each place of the largest call is tried."""

_found: weakref.WeakKeyDictionary[PolicyNetwork, dict[int, tuple[int, ...]]] = weakref.WeakKeyDictionary()


def find_safe_sizes(network: PolicyNetwork) -> tuple[int, ...]:
    """Sizes of calls, ascending, that give the same bits as calls of ``BATCH``; that one is always among them.

    Libraries choose by the number of rows how to add up, and choose otherwise on other machines, so it is tried: here,
    with these weights and as many threads as torch has now. Sums in another order differ in the last bits whatever the
    numbers are, so that made-up inputs show it. It takes some tenths of a second, once a process and network.
    """
    known = _found.setdefault(network, {})
    threads = torch.get_num_threads()
    if threads not in known:
        inputs = _make_inputs(network)
        wanted = _answer(network, inputs, BATCH)
        known[threads] = tuple(
            size for size in CANDIDATES if size == BATCH or _equal(_answer(network, inputs, size), wanted)
        )
    return known[threads]


def split_calls(count: int, sizes: Sequence[int]) -> list[tuple[int, int]]:
    """Calls that ``count`` robots are asked for in: for each, how many they are and to how many they are filled up.

    Args:
        count: robots.
        sizes: those that a call may have, ascending.
    """
    full, rest = divmod(count, sizes[-1])
    calls = [(sizes[-1], sizes[-1])] * full
    return [*calls, (rest, next(size for size in sizes if size >= rest))] if rest else calls


def _make_inputs(network: PolicyNetwork) -> tuple[Tensor, ...]:
    """Vectors, then images and states if the network takes them, of ``_ROWS`` robots: the same at any time. Torch's own
    random numbers stay as they are."""
    random = torch.Generator().manual_seed(0)
    vector = torch.randn(_ROWS, network.observation_size, generator=random)
    if not isinstance(network, DepthNetwork):
        return (vector,)
    image = torch.rand(_ROWS, *(network.image or (1, 1)), generator=random)
    state = [torch.randn(part.shape, generator=random) for part in network.initial_state(_ROWS)]
    return (vector, image, *state)


def _answer(network: PolicyNetwork, inputs: Sequence[Tensor], size: int) -> list[Tensor]:
    """Actions and states from calls of one size, one row a robot; the last call begins again with the first robots."""
    vector, *seen = inputs
    calls = []
    with torch.no_grad():
        for first in range(0, _ROWS, size):
            rows = torch.arange(first, first + size) % _ROWS
            if not seen:
                calls.append([network(vector[rows])])
                continue
            image, *state = seen
            before, fresh = tuple(part[:, rows] for part in state), torch.zeros(1, size, dtype=torch.bool)
            # called as ``BatchedPolicy`` does, layout in memory included: it decides too how libraries add up
            answer, after = cast(Any, network)(image[rows][None], vector[rows][None], before, fresh)
            calls.append([answer[0], *(part.transpose(0, 1) for part in after)])
    return [torch.cat(parts)[:_ROWS] for parts in zip(*calls, strict=True)]


def _equal(some: Sequence[Tensor], others: Sequence[Tensor]) -> bool:
    return all(torch.equal(a, b) for a, b in zip(some, others, strict=True))
