"""Whether robots walk over the blocks or around them."""

import numpy as np
import pytest

from vinl.courses.grounds import GroundConfig, build_ground
from vinl.courses.robot_records import RobotRecord, aggregate_robots


def test_ground_knows_where_its_blocks_lie():
    ground = build_ground(GroundConfig("blocks", 1.0, None, 0, 40.0, 2.0))
    assert ground.on_block(ground.blocks.rows[:, :2]).all()
    assert not ground.on_block(ground.blocks.rows[:, :2] + np.array([200.0, 0.0])).any()
    area = (ground.blocks.rows[:, 3] * ground.blocks.rows[:, 4]).sum() / 24**2
    assert ground.covered() == pytest.approx(area, rel=0.1)
    assert build_ground(GroundConfig("blocks", 0.0, None, 0, 40.0, 2.0)).covered() is None


def test_one_is_a_robot_that_walks_as_if_there_were_no_blocks():
    records = [RobotRecord(k, "blocks", None, steps=1000, metres=5.0, over_block_steps=70) for k in range(4)]
    assert aggregate_robots(records, covered=0.07)["trunk_over_blocks"] == pytest.approx(1.0)
    assert "trunk_over_blocks" not in aggregate_robots(records)
