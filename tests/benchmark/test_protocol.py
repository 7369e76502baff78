"""How episodes are cut into pieces of work: each once, alike in length, the longest first."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vinl.benchmark.protocol import LARGEST, Row, cut_jobs, each_key, longest_first, split_evenly
from vinl.chain.batching import CANDIDATES
from vinl.chain.navigators.oracle import OracleNavigator
from vinl.policies.io import load_policy
from vinl.world.floorplan import FloorPlan
from vinl.world.start_goal import StartGoal


@given(st.integers(0, 60), st.integers(1, 25))
def test_pieces_hold_each_cell_once_and_are_as_large_as_each_other(count: int, largest: int) -> None:
    pieces = split_evenly(range(count), largest)
    assert [cell for piece in pieces for cell in piece] == list(range(count))
    sizes = [len(piece) for piece in pieces]
    assert all(0 < size <= largest for size in sizes)
    assert not sizes or max(sizes) - min(sizes) <= 1
    assert len(pieces) == -(-count // largest)


def route(length: float) -> StartGoal:
    return StartGoal(np.zeros(2), 0.0, np.array([length, 0.0]), length, length)


@pytest.mark.parametrize("workers", [1, 2, 16, 64])
def test_episodes_of_one_length_walk_together_and_the_longest_begin(two_rooms: FloorPlan, workers: int) -> None:
    lengths = [5.0, 12.0, 7.0, 9.0, 20.0, 6.0, 15.0, 8.0]
    routes, row = [[route(length) for length in lengths]], Row(load_policy("rough"), OracleNavigator())
    wanted = list(each_key([two_rooms], len(lengths), range(5)))
    missing = [key for key in wanted if key != (two_rooms.name, 1, 4)]
    jobs = longest_first(cut_jobs(0, row, [two_rooms], routes, wanted, missing, {wanted[3]}, workers), routes)
    walked = [cell for job in jobs for cell in job.cells]
    assert sorted(walked) == sorted(key[1:] for key in missing)
    assert [lengths[k] for _, k in walked] == sorted((lengths[k] for _, _, k in missing), reverse=True)
    assert [cell for job in jobs for cell in job.filmed] == [wanted[3][1:]]
    assert max(len(job.cells) for job in jobs) <= LARGEST
    if workers == 1:  # nobody to share with
        assert len(jobs) == -(-len(missing) // LARGEST)
    elif len(missing) <= CANDIDATES[0] * workers:  # a call costs as much with one robot as with so many
        assert len(missing) / CANDIDATES[0] <= len(jobs) <= workers
    else:
        assert len(jobs) >= 2 * workers
