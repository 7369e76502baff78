"""Rows compared on the same episodes, on records made by hand."""

from dataclasses import replace

import pytest
from small_home import RECORD

from vinl.benchmark.metrics import compare_rows, difference, mcnemar_p


def make(outcomes: str, steps: int = 0) -> list:
    """One record a letter (``1``: success), five start/goal pairs of a plan before the next seed begins."""
    return [
        replace(RECORD, seed=k // 5, episode=k % 5, success=letter == "1", foot_steps=steps, distance_m=8.0)
        for k, letter in enumerate(outcomes)
    ]


def test_mcnemar() -> None:
    assert mcnemar_p(0, 0) == 1.0
    assert mcnemar_p(3, 3) == 1.0
    assert mcnemar_p(0, 6) == pytest.approx(2 / 64)
    assert mcnemar_p(8, 2) == mcnemar_p(2, 8) == pytest.approx(0.109375)


def test_differences() -> None:
    one, other = make("1111101111", steps=8), make("1100101100", steps=24)
    found = compare_rows(one, other)
    assert found["episodes"] == 10
    success = found["success"]
    assert success["difference"] == pytest.approx(0.4)
    assert (success["only_one"], success["only_other"], success["p"]) == (4, 0, 0.125)
    low, high = success["ci95"]
    assert low < 0.4 < high and low > 0
    assert found["foot_collisions_per_m"]["difference"] == pytest.approx(-2.0)
    assert found["foot_collisions_per_m"]["ci95"] == [-2.0, -2.0]
    assert compare_rows(other, one)["success"]["difference"] == pytest.approx(-0.4)
    assert compare_rows(one, other) == found  # the bootstrap repeats


def test_only_episodes_that_both_have() -> None:
    one, other = make("11111"), make("00000")[2:]
    assert compare_rows(one, other)["episodes"] == 3
    short = [replace(record, distance_m=0.5) for record in other]
    found = compare_rows(one, short)
    assert found["success"]["episodes"] == 3 and found["foot_collisions_per_m"]["difference"] is None
    assert compare_rows(one, [])["success"]["ci95"] is None


def test_seeds_of_a_way_are_not_independent() -> None:
    """All seeds of a start/goal pair go together: five seeds that agree are no narrower than one."""
    pairs = list(zip(make("11100" * 5), make("00000" * 5), strict=True))
    once = list(zip(make("11100"), make("00000"), strict=True))
    assert difference(pairs, lambda r: r.success) == {**difference(once, lambda r: r.success), "episodes": 25}
