"""The locomotor alone."""

import numpy as np
import pytest

from vinl.chain.scene import build_scene
from vinl.courses.block_contacts import BINS
from vinl.courses.courses import COMMANDS, FIXED, Course, Start, choose_commands, command_ranges, draw_commands
from vinl.courses.evaluate import compare_locomotors
from vinl.courses.grounds import GroundConfig, build_ground
from vinl.courses.robot_records import RobotRecord, aggregate_robots
from vinl.courses.trial import BoxHerd
from vinl.policies.policy import LocomotionPolicy
from vinl.robot.aliengo import DEFAULT_POSE
from vinl.world.boxes import Blocks, Boxes


def test_same_numbers_from_two_processes(trotting: LocomotionPolicy) -> None:
    runs = [compare_locomotors([trotting], "blocks", 18, 0.6, workers=w)[0] for w in (1, 2)]
    assert runs[0].records == runs[1].records
    assert [r.robot for r in runs[0].records] == list(range(18))


def test_names_that_others_read(standing: LocomotionPolicy) -> None:
    figures = compare_locomotors([standing], "flat", 2, 0.5)[0].aggregate
    assert figures["falls"] == 0
    assert {"linear_velocity_rmse", "yaw_rate_rmse", "foot_block_per_m", "leg_block_per_m", "metres"} <= figures.keys()
    assert figures["mean_level"] is None


def test_rough_ground_has_levels() -> None:
    ground = build_ground(GroundConfig("rough", 1.0, None, 0, 40.0, 2.0))
    assert ground.levels[:64].mean() >= 5
    assert set(ground.kinds) == {"slope", "rough_slope", "stairs_up", "stairs_down", "discrete"}
    assert set(build_ground(GroundConfig("rough", 1.0, 3, 0, 40.0, 2.0)).levels) == {3}


def test_in_rooms_walls_stand_close_to_every_start_and_cameras_see_them(standing: LocomotionPolicy) -> None:
    ground = build_ground(GroundConfig("rooms", 1.0, None, 0, 40.0, 2.0))
    bare = build_ground(GroundConfig("rooms", 0.0, 9, 0, 40.0, 2.0))
    assert set(ground.kinds) == {"rooms"} and set(ground.levels) == set(range(1, 10))
    assert not len(bare.blocks) and set(bare.levels) == {9}
    starts = np.array(
        [[s.x, s.y] for robot in range(72) for s in [Course(ground, FIXED["turns"], 0, robot, 9).draw_start()]]
    )
    gaps = ground.walls.distances(starts).min(0)
    assert gaps.min() > 0.3 and gaps.max() < 1.5
    assert len(ground.mesh()[1]) > 12 * len(ground.walls)
    assert choose_commands(None, "rooms") == "navigator"
    assert 0 < (ground.covered() or 0) < 0.1 and bare.covered() is None
    figures = compare_locomotors([standing], "rooms", 2, 0.5)[0].aggregate
    assert figures["falls"] == 0 and figures["mean_level"] is not None


def test_commands_are_those_of_the_training_but_not_faster(standing: LocomotionPolicy) -> None:
    assert command_ranges("trained", [standing]).forward == (-1.0, 1.0)
    standing.card.training["commands"] = {"forward": [0.0, 1.0], "left": [0.0, 0.0], "yaw_rate": [-1.05, 1.05]}
    try:
        ranges = command_ranges("trained", [standing])
    finally:
        del standing.card.training["commands"]
    assert (ranges.forward, ranges.left, ranges.yaw_rate) == ((0.0, 1.0), (0.0, 0.0), (-1.0, 1.0))
    assert command_ranges("forward", [standing]).left == (0.0, 0.0)


def test_commands_of_every_name_stay_in_their_ranges(standing: LocomotionPolicy) -> None:
    defaults = {"blocks": "home", "litter": "steady", "rooms": "navigator", "flat": "trained"}
    assert {terrain: choose_commands(None, terrain) for terrain in defaults} == defaults
    for name in COMMANDS:
        ranges = command_ranges(name, [standing])
        commands, fresh = draw_commands(ranges, np.random.default_rng(0), 20_000)
        assert fresh[0] and fresh.sum() > 20
        assert (commands[1:] == commands[:-1]).all(1)[~fresh[1:]].all()
        for k, bounds in enumerate((ranges.forward, ranges.left, ranges.yaw_rate)):
            assert commands[:, k].min() >= min(bounds[0], 0) and commands[:, k].max() <= max(bounds[1], 0)
    asked, fresh = draw_commands(FIXED["navigator"], np.random.default_rng(0), 20_000)
    assert (np.diff(np.flatnonzero(fresh)) % 25 == 0).all()
    assert (asked == 0).all(1).any() and ((asked[:, 0] == 0) & (asked[:, 2] != 0)).any()
    assert draw_commands(FIXED["turns"], np.random.default_rng(0), 20_000)[0][:, 0].min() >= 0.3
    home = draw_commands(FIXED["home"], np.random.default_rng(0), 20_000)[0]
    assert home[:, 0].min() >= 0.3 and home[:, 0].max() <= 0.8 and 0.5 < np.abs(home[:, 2]).max() <= 0.6
    assert (draw_commands(FIXED["steady"], np.random.default_rng(0), 900)[0] == [0.4, 0.0, 0.0]).all()


def test_all_policies_meet_the_same_courses(standing: LocomotionPolicy, trotting: LocomotionPolicy) -> None:
    alone = compare_locomotors([trotting], "blocks", 3, 0.5)[0]
    together = compare_locomotors([standing, trotting], "blocks", 3, 0.5)
    assert together[1].records == alone.records
    assert together[0].config == together[1].config
    ground = build_ground(GroundConfig("blocks", 1.0, None, 0, 40.0, 2.0))
    bare = build_ground(GroundConfig("blocks", 0.0, None, 0, 40.0, 2.0))
    course, other = (Course(g, FIXED["turns"], 0, 5, 100) for g in (ground, bare))
    np.testing.assert_array_equal(course.commands, other.commands)
    assert ground.reach == bare.reach < np.inf
    start = course.draw_start()
    gap = np.linalg.norm(ground.blocks.rows[:, :2] - [start.x, start.y], axis=1).min()
    assert gap > 0.65


def test_feet_and_legs_are_told_apart(standing: LocomotionPolicy) -> None:
    block = Blocks(np.array([[0.24, 0.13, 0.0, 0.3, 0.2, 0.13]]))  # under the front left foot
    herd = BoxHerd(build_scene(Boxes.empty(), block.boxes()), 2)
    herd.start(0, Start(0.0, 0.0, 0.0, DEFAULT_POSE, 0.1))
    herd.start(1, Start(5.0, 0.0, 0.0, DEFAULT_POSE, 0.0))
    feet, bins = np.zeros((2, 4), bool), np.zeros((2, BINS), bool)
    for _ in range(8):
        herd.step(np.stack([DEFAULT_POSE] * 2))
        feet |= herd.touches.feet
        bins |= herd.touches.foot_bins
    assert feet[0, 0] and not feet[0, 1:].any() and not feet[1].any()
    assert bins[0].tolist() == [False, True, False, False, False]


def test_figures_of_known_records() -> None:
    records = [
        RobotRecord(k, "blocks", None, metres=2.0, steps=10, foot_block_steps=k, foot_pair_steps=[k, 0]) for k in (0, 4)
    ]
    records[1].falls, records[1].errors, records[1].foot_height_steps = 1, [0.2, 0.0, 0.0, 0.0], [0, 4, 0, 0, 0]
    figures = aggregate_robots(records, np.array([0.5, 0.5, 0.0, 0.0, 0.0]))
    assert figures["foot_block_per_m"] == 1.0 and figures["falls"] == 0.5
    assert figures["foot_front_block_per_m"] == 1.0 and figures["foot_rear_block_per_m"] == 0.0
    assert figures["linear_velocity_rmse"] == 0.1
    assert figures["ci95"]["foot_block_per_m"] == [0.0, 2.0]
    assert figures["foot_block_per_m_by_height"]["0.12-0.14"] == 2.0
    assert figures["foot_block_per_m_by_height"]["0.14-0.16"] is None


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"robots": 0}, "--robots"),
        ({"seconds": float("nan")}, "--seconds"),
        ({"terrain": "swamp"}, "--terrain"),
        ({"terrain": "blocks", "density": -1.0}, "--density"),
        ({"terrain": "blocks", "density": 10.0}, "--density"),
        ({"terrain": "litter", "density": 31.0}, "--density"),
        ({"terrain": "rough", "level": 10}, "--level"),
        ({"level": 3}, "--level"),
        ({"terrain": "blocks", "level": 3}, "--level"),
        ({"terrain": "rooms", "level": -1}, "--level"),
        ({"commands": "turn"}, "did you mean"),
    ],
)
def test_bad_options(standing: LocomotionPolicy, options: dict, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        compare_locomotors([standing], **options)
