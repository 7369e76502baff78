"""The ground under robots that walk in different clutter."""

import numpy as np

from vinl.chain.ground_reader import ScanReader
from vinl.robot.aliengo import home_qpos
from vinl.robot.observation import SCAN_POINTS
from vinl.world.boxes import Blocks
from vinl.world.floorplan import FloorPlan


def test_each_robot_reads_its_own_blocks(two_rooms: FloorPlan) -> None:
    here = Blocks(np.array([[6.5, 3.0, 0.0, 0.4, 0.4, 0.15]]))
    qpos = np.stack([home_qpos(6.5, 3.0)] * 3)
    scan = ScanReader(two_rooms, [Blocks.empty(), here, Blocks.empty()]).read(qpos)
    middle = np.abs(SCAN_POINTS).max(1) < 0.15
    assert (scan[[0, 2]] == 0).all()
    np.testing.assert_allclose(scan[1, middle], 0.15, atol=1e-6)


def test_walls_are_high(two_rooms: FloorPlan) -> None:
    scan = ScanReader(two_rooms, [Blocks.empty()]).read(home_qpos(0.5, 3.0)[None])[0]
    np.testing.assert_allclose(scan[np.isclose(SCAN_POINTS[:, 0], -0.5)], 2.5)
    assert (scan[SCAN_POINTS[:, 0] > 0] == 0).all()
