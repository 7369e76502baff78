"""Figures of hand-made records."""

import math
from dataclasses import replace

import numpy as np
import pytest
from small_home import RECORD

from vinl.benchmark.metrics import aggregate_episodes
from vinl.chain.metrics import bootstrap_interval, soft_spl, spl, summarise, wilson_interval


def test_spl() -> None:
    assert spl(True, 6.0, 8.0) == pytest.approx(0.75)
    assert spl(True, 6.0, 5.8) == 1.0  # the goal has a radius: the way may be shorter than the shortest
    assert spl(False, 6.0, 8.0) == 0.0


def test_soft_spl() -> None:
    assert soft_spl(6.0, 0.0, 6.0) == 1.0
    assert soft_spl(6.0, 3.0, 12.0) == pytest.approx(0.25)
    assert soft_spl(6.0, 7.0, 1.0) == 0.0
    assert soft_spl(6.0, math.inf, 1.0) == 0.0


def test_wilson_interval() -> None:
    low, high = wilson_interval(40, 50)
    assert (low, high) == (pytest.approx(0.6696, abs=1e-3), pytest.approx(0.8876, abs=1e-3))
    assert wilson_interval(0, 10)[0] == 0.0
    assert wilson_interval(10, 10)[1] == 1.0


def test_bootstrap_interval_holds_the_mean_and_repeats() -> None:
    values = np.linspace(0, 1, 50)
    low, high = bootstrap_interval(values)
    assert low < 0.5 < high
    assert bootstrap_interval(values) == (low, high)


def test_spread_is_that_of_the_seeds() -> None:
    figure = summarise([1.0, 3.0, 5.0, 7.0], [0, 0, 1, 1])
    assert figure["mean"] == 4.0
    assert figure["std_over_seeds"] == 2.0  # means 2 and 6, divided by their number
    assert summarise([], []) == {"mean": None, "std_over_seeds": None, "ci95": None}


def test_rates_are_ratios_of_episodes() -> None:
    short = replace(RECORD, seed=1, distance_m=0.5, foot_steps=50, success=False, fell=True, end_reason="fall", spl=0.0)
    other = replace(RECORD, seed=1, distance_m=4.0)
    figures = aggregate_episodes([RECORD, other, short])
    assert figures["foot_collisions_per_m"]["mean"] == pytest.approx((16 / 8 + 16 / 4) / 2)  # not the 0.5 m walked
    assert figures["foot_block_per_m"]["mean"] == pytest.approx((12 / 8 + 12 / 4) / 2)
    assert figures["foot_wall_per_m"]["mean"] == pytest.approx((1 + 2) / 2)
    assert figures["leg_contacts_per_m"]["mean"] == pytest.approx((0.5 + 1) / 2)
    assert figures["paper_foot_collisions_per_m"]["mean"] == pytest.approx((3 + 6) / 2)
    assert figures["success"]["mean"] == pytest.approx(2 / 3, abs=1e-6)
    assert figures["falls"] == pytest.approx(1 / 3, abs=1e-6)
    assert (figures["episodes"], figures["episodes_in_rates"]) == (3, 2)
    assert figures["end_reasons"] == {"success": 2, "fall": 1, "stuck": 0, "looping": 0, "timeout": 0}
    assert figures["failures"]["fall"] == {"block": 0, "wall": 0, "free": 1}
