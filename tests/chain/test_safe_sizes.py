"""A network is asked in sizes that were tried to give the bits of calls of eight, and in no others."""

from collections.abc import Callable

import pytest
import torch
from torch import Tensor

from vinl.chain.batching import BATCH, CANDIDATES, find_safe_sizes, split_calls
from vinl.policies.io import load_policy
from vinl.policies.networks import PolicyNetwork


class Asked(PolicyNetwork):
    """Answers by how many rows there are, and counts its calls."""

    observation_size, action_size = 3, 12

    def __init__(self, answer: Callable[[Tensor], Tensor]) -> None:
        super().__init__()
        self.calls, self.answer = 0, answer

    def forward(self, observation: Tensor) -> Tensor:
        self.calls += 1
        return self.answer(observation)


def last_bit_unless(fits: Callable[[int], bool]) -> Callable[[Tensor], Tensor]:
    return lambda x: x if fits(len(x)) else torch.nextafter(x, x + 1)


def odd_in_fifth_place(x: Tensor) -> Tensor:
    x = x.clone()
    if len(x) == 12:
        x[4] = torch.nextafter(x[4], x[4] + 1)
    return x


def odd_in_last_place(x: Tensor) -> Tensor:
    x = x.clone()
    if len(x) > 1:
        x[-1] = torch.nextafter(x[-1], x[-1] + 1)
    return x


def test_where_the_place_in_a_call_counts_each_is_asked_alone() -> None:
    network = Asked(odd_in_last_place)
    assert find_safe_sizes(network) == (1,)
    assert split_calls(3, find_safe_sizes(network)) == [(1, 1)] * 3


def test_all_sizes_that_agree_are_safe() -> None:
    assert find_safe_sizes(Asked(lambda x: x)) == CANDIDATES


@pytest.mark.parametrize(
    ("answer", "safe"),
    [
        (last_bit_unless(lambda rows: rows >= 8), tuple(size for size in CANDIDATES if size >= 8)),
        (last_bit_unless(lambda rows: rows == BATCH), (BATCH,)),
        (odd_in_fifth_place, tuple(size for size in CANDIDATES if size != 12)),
    ],
)
def test_a_size_that_differs_in_one_bit_or_one_place_is_not(
    answer: Callable[[Tensor], Tensor], safe: tuple[int, ...]
) -> None:
    assert find_safe_sizes(Asked(answer)) == safe


def test_is_tried_once_a_network_and_leaves_random_numbers_alone() -> None:
    torch.manual_seed(3)
    expected = torch.rand(2)
    torch.manual_seed(3)
    network = Asked(lambda x: x)
    find_safe_sizes(network)
    calls = network.calls
    find_safe_sizes(network)
    assert network.calls == calls
    assert torch.equal(torch.rand(2), expected)


def test_sizes_found_safe_for_a_shipped_network_are_so_for_other_inputs() -> None:
    network = load_policy("teacher").network
    sizes, random = find_safe_sizes(network), torch.Generator().manual_seed(7)
    rows = torch.randn(48, network.observation_size, generator=random)

    def answer(size: int) -> Tensor:
        return torch.cat([network(rows[k : k + size]) for k in range(0, 48 - 48 % size, size)])

    with torch.no_grad():
        expected = answer(BATCH)
        for size in sizes:
            given = answer(size)
            assert torch.equal(given, expected[: len(given)]), size


@pytest.mark.parametrize(
    ("count", "calls"),
    [
        (0, []),
        (1, [(1, 4)]),
        (4, [(4, 4)]),
        (5, [(5, 8)]),
        (24, [(24, 24)]),
        (27, [(24, 24), (3, 4)]),
        (50, [(24, 24), (24, 24), (2, 4)]),
    ],
)
def test_calls_hold_all_robots_in_sizes_that_may_be(count: int, calls: list[tuple[int, int]]) -> None:
    assert split_calls(count, (4, 8, 24)) == calls
