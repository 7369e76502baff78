"""Straight over one block: traces, plot and film."""

from dataclasses import replace
from pathlib import Path

import imageio.v2 as imageio
import numpy as np
import pytest

from vinl.courses import crossing_film
from vinl.courses.crossing import Crossing, cross_block, draw_steps
from vinl.policies.io import load_policy
from vinl.policies.policy import LocomotionPolicy


@pytest.fixture(scope="module")
def crossing() -> Crossing:
    return cross_block(load_policy("rough"), 0.1, 0.8, crossings=1)[0]


def test_rough_comes_across_and_is_seen_to_touch(crossing: Crossing) -> None:
    assert crossing.done
    assert crossing.qpos[0, 0] < -1.3 and crossing.qpos[-1, 0] > 1.1
    feet = crossing.feet
    over = (np.abs(feet[..., 0]) < 0.09) & (np.abs(feet[..., 1]) < 0.39)
    assert over.any() and feet[over][:, 2].min() > 0.1
    assert (np.abs(feet[crossing.foot_touches][:, 0]) < 0.14).all()


def test_a_fall_or_standing_still_is_not_across(standing: LocomotionPolicy, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("vinl.courses.crossing._PATIENCE", 0.1)
    crossing = cross_block(standing, crossings=1)[0]
    assert not crossing.done and len(crossing.qpos) == len(crossing.foot_touches) > 10


@pytest.mark.parametrize("name", ["step.mp4", "step.gif"])
def test_pictures_are_written(name: str, crossing: Crossing, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(crossing_film, "SIZE", (64, 32))
    few = replace(
        crossing, **{k: getattr(crossing, k)[-150::12] for k in ("qpos", "feet", "foot_touches", "leg_touches")}
    )
    ways = {"a": [few], "b": [few]}
    draw_steps(ways, 0.1, Path("out/step.png"))
    crossing_film.film_steps(ways, 0.1, Path("out") / name)
    assert sorted(p.name for p in Path("out").iterdir()) == sorted([name, "step.png"])
    with imageio.get_reader(Path("out") / name) as film:
        assert film.get_data(0).shape[:2] == (64, 64)
