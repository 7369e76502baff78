"""Litter: what lies there, where robots start, which steps are dirty."""

import mujoco
import numpy as np
import pytest

from vinl.courses.courses import FIXED, FOOT_CLEARANCE, Course
from vinl.courses.evaluate import compare_locomotors
from vinl.courses.grounds import LITTER_FIELD, GroundConfig, build_ground
from vinl.courses.trial import BoxHerd, run_trial
from vinl.policies.policy import LocomotionPolicy
from vinl.robot.aliengo import CONTROL_DT, foot_positions, home_qpos

SPARSE = GroundConfig("litter", 5.0, None, 0, 40.0, 2.0)


class PacingHerd(BoxHerd):
    """Robots that glide ahead at 0.4 m/s and lift their front left foot every half second, so high [m]."""

    lift, time = 0.0, 0

    def step(self, targets, rows=None):
        self.time += 1
        for k, body in enumerate(self._robots):
            heading = 2 * np.arctan2(body.qpos[6], body.qpos[3])
            body.qpos[:2] += 0.4 * CONTROL_DT * np.array([np.cos(heading), np.sin(heading)])
            body.qpos[2] = home_qpos()[2] - 0.005
            body.qpos[7:] = home_qpos()[7:]
            if self.time % 25 < 12:  # the knee bends while the thigh turns: the foot rises straight up
                body.qpos[8:10] += 2 * self.lift, -4 * self.lift
            body.contacts.clear()
            mujoco.mj_forward(body.model, body.data)
            body.contacts.look()
            self._readers[k].sum_up()
            self.fallen[k] = False
            self._robots.read(k)


def test_objects_are_small_low_and_as_many_as_asked_for() -> None:
    rows = build_ground(SPARSE).blocks.rows
    assert len(rows) == 5 * (2 * LITTER_FIELD) ** 2
    assert rows[:, 3:5].min() >= 0.05 and rows[:, 3:5].max() <= 0.15
    assert rows[:, 5].min() >= 0.03 and rows[:, 5].max() <= 0.10


def test_no_robot_starts_with_a_foot_on_an_object() -> None:
    ground = build_ground(GroundConfig("litter", 20.0, None, 0, 40.0, 2.0))
    boxes = ground.blocks.boxes()
    for robot in range(6):
        start = Course(ground, FIXED["steady"], 0, robot, 10).draw_start()
        feet = foot_positions(np, home_qpos(start.x, start.y, yaw=start.yaw)[None])[0, :, :2]
        assert boxes.distances(feet).min() > FOOT_CLEARANCE - 0.03


def test_steps_that_touch_are_dirty(standing: LocomotionPolicy) -> None:
    found = {}
    for density in (5.0, 0.0):
        ground = build_ground(GroundConfig("litter", density, None, 0, 40.0, 2.0))
        courses = [Course(ground, FIXED["steady"], 0, k, 300) for k in range(2)]
        herd = PacingHerd(ground.model, 2)
        herd.lift = 0.15
        found[density] = run_trial(herd, ground, courses, standing)
    for dirty, clean in zip(found[5.0], found[0.0], strict=True):
        # 6 s, of which the first half metre, 1.25 s, does not count: nine times half a second
        assert 8 <= clean.swings <= 10 and clean.dirty_swings == 0
        assert 0 < dirty.dirty_swings <= dirty.swings and dirty.dirty_foot_swings <= dirty.dirty_swings
        assert dirty.foot_block_steps > 0


def test_names_that_others_read(standing: LocomotionPolicy) -> None:
    results = compare_locomotors([standing], "litter", 2, 0.3)[0]
    assert results.config["ground"]["density"] == 10.0
    figures = results.aggregate
    assert figures["dirty_steps"] is None and figures["steps"] == 0
    assert {"dirty_foot_steps", "foot_block_per_m", "cost_of_transport", "leg_leg_per_m"} <= figures.keys()
    assert "foot_block_per_m_by_height" not in figures


def test_dirty_share_has_an_interval() -> None:
    from vinl.courses.robot_records import RobotRecord, aggregate_robots

    records = [RobotRecord(k, "litter", None, steps=10, swings=10, dirty_swings=2 * k) for k in range(4)]
    figures = aggregate_robots(records, covered=0.1)
    assert figures["dirty_steps"] == pytest.approx(0.3) and figures["steps"] == 40
    assert figures["ci95"]["dirty_steps"][0] < 0.3 < figures["ci95"]["dirty_steps"][1]
