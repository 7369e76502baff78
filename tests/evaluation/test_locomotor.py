"""The locomotor alone."""

import pytest

from vinl.evaluation.grounds import GroundConfig, build_ground
from vinl.evaluation.locomotor import command_ranges, evaluate_locomotor
from vinl.policies.policy import LocomotionPolicy


def test_same_numbers_from_two_processes(trotting: LocomotionPolicy) -> None:
    runs = [evaluate_locomotor(trotting, "blocks", 18, 0.6, workers=w) for w in (1, 2)]
    assert runs[0].robots == runs[1].robots
    assert [r.robot for r in runs[0].robots] == list(range(18))


def test_names_that_others_read(standing: LocomotionPolicy) -> None:
    figures = evaluate_locomotor(standing, "flat", 2, 0.5).aggregate
    assert figures["falls"] == 0
    assert {"linear_velocity_rmse", "yaw_rate_rmse", "foot_block_per_m", "leg_block_per_m", "metres"} <= figures.keys()
    assert figures["mean_level"] is None


def test_rough_ground_has_levels() -> None:
    ground = build_ground(GroundConfig("rough", 1.0, None, 0, 40.0, 2.0))
    assert ground.levels[:64].mean() >= 5
    assert set(ground.kinds) == {"slope", "rough_slope", "stairs_up", "stairs_down", "discrete"}
    assert set(build_ground(GroundConfig("rough", 1.0, 3, 0, 40.0, 2.0)).levels) == {3}


def test_commands_are_those_of_the_training_but_not_faster(standing: LocomotionPolicy) -> None:
    assert command_ranges(standing).forward == (-1.0, 1.0)
    standing.card.training["commands"] = {"forward": [0.0, 1.0], "left": [0.0, 0.0], "yaw_rate": [-1.05, 1.05]}
    try:
        ranges = command_ranges(standing)
    finally:
        del standing.card.training["commands"]
    assert (ranges.forward, ranges.left, ranges.yaw_rate) == ((0.0, 1.0), (0.0, 0.0), (-1.0, 1.0))


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"robots": 0}, "--robots"),
        ({"seconds": float("nan")}, "--seconds"),
        ({"terrain": "swamp"}, "--terrain"),
        ({"terrain": "blocks", "density": -1.0}, "--density"),
        ({"terrain": "rough", "level": 10}, "--level"),
        ({"level": 3}, "--level"),
    ],
)
def test_bad_options(standing: LocomotionPolicy, options: dict, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        evaluate_locomotor(standing, **options)
