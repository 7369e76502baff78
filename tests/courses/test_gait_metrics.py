"""Figures of how a robot walks."""

import numpy as np
import pytest

from vinl.courses.block_contacts import Strain
from vinl.courses.robot_records import GaitRecord, aggregate_gait, record_gait
from vinl.robot.aliengo import MASS, foot_positions, home_qpos


def test_feet_that_meet_and_feet_above_their_hip_are_seen():
    standing, crossed, raised = home_qpos(), home_qpos(), home_qpos()
    crossed[[7, 10]] = -0.4, 0.4  # both front legs swing inwards
    raised[7:10] = 0.0, 2.2, -0.7
    qpos = np.stack([standing, crossed, raised])
    records = [GaitRecord() for _ in qpos]
    record_gait(records, Strain.none(3), qpos)
    feet = foot_positions(np, qpos)
    assert records[0].foot_distance_min == pytest.approx(np.linalg.norm(feet[0, 0] - feet[0, 1]), rel=0.2)
    assert [r.feet_close_steps for r in records] == [0, 1, 0]
    assert [r.foot_above_hip_steps for r in records] == [0, 0, 1] and feet[2, 0, 2] > 0.38


def test_figures_of_known_strain():
    records = [GaitRecord(), GaitRecord()]
    strain = Strain.none(2)
    strain.work[:], strain.speed[:], strain.leg_leg[0] = MASS * 9.81 * 0.1, (0.5, 1.2), True
    for _ in range(5):
        record_gait(records, strain, np.stack([home_qpos()] * 2))
    record_gait(records, Strain.none(2), np.stack([home_qpos()] * 2), rows=[0])
    figures = aggregate_gait(records, 2.0)
    assert figures["cost_of_transport"] == pytest.approx(0.5)
    assert figures["joint_overspeed"] == pytest.approx(5 / 11) and figures["joint_speed_peak"] == 1.2
    assert figures["leg_leg_per_m"] == 2.5 and figures["feet_close"] == 0
    assert aggregate_gait([GaitRecord()], 0.0) == {}
    assert aggregate_gait(records, 0.0)["cost_of_transport"] is None
