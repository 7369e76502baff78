"""Gaits of several robots with maps of their own, as one unit of the evaluation has them."""

from __future__ import annotations

import numpy as np
import pytest

from vinl.chain.ground_reader import GaitReader, map_plan
from vinl.gait.config import GaitConfig
from vinl.robot.aliengo import CONTROL_DT, home_qpos
from vinl.world.boxes import Blocks, Boxes
from vinl.world.floorplan import FloorPlan, assemble_floorplan
from vinl.world.grid import GridFrame


@pytest.fixture
def room() -> FloorPlan:
    """A room of 6 m x 4 m about the origin, with a wall at its right end."""
    wall = Boxes(np.array([[2.9, 0.0, 0.0, 0.2, 4.0, 0.0, 2.5]]))
    frame = GridFrame(-2.975, -1.975, 0.05, (80, 120))
    return assemble_floorplan("room", "test", wall, Boxes.empty(), np.ones((80, 120), bool), frame)


def _walk(reader: GaitReader, places: np.ndarray, steps: int, reset_at: int | None = None) -> list[np.ndarray]:
    """Robots that glide on along x."""
    n, rows = len(places), []
    for step in range(steps):
        if step == reset_at:
            reader.reset(np.arange(n) == 0)
        qpos = np.stack([home_qpos(x + 0.5 * step * CONTROL_DT, y, 0.38, 0.0) for x, y in places])
        qvel = np.zeros((n, 18))
        qvel[:, 0] = 0.5
        rows.append(reader.read(qpos, qvel, np.tile([0.5, 0.0, 0.0], (n, 1)))[1])
    return rows


def test_each_robot_reads_its_own_clutter_and_neighbours_change_nothing(room: FloorPlan) -> None:
    bar = Blocks(np.array([[0.75, 0.0, np.pi / 2, 1.0, 0.2, 0.1]]))
    places = np.array([[0.0, 0.0], [0.0, 0.0]])
    both = GaitReader(GaitConfig(), map_plan(room, [bar, Blocks.empty()]))
    rows = _walk(both, places, 45)
    alone = GaitReader(GaitConfig(), map_plan(room, [bar]))
    np.testing.assert_allclose([r[:1] for r in _walk(alone, places[:1], 45)], [r[:1] for r in rows], atol=1e-9)
    assert max(np.abs(r[0] - r[1]).max() for r in rows) > 0.1  # one has a bar before it, the other has not


def test_a_robot_hurries_over_its_own_clutter_alone(room: FloorPlan) -> None:
    bar = Blocks(np.array([[0.75, 0.0, np.pi / 2, 1.0, 0.2, 0.1]]))
    reader = GaitReader(GaitConfig(), map_plan(room, [bar, Blocks.empty()]))
    qpos, slow = np.tile(home_qpos(0.2, 0.0, 0.38, 0.0), (2, 1)), np.tile([0.3, 0.0, 0.2], (2, 1))
    command, _ = reader.read(qpos, np.zeros((2, 18)), slow)
    np.testing.assert_allclose(command, [[0.5, 0.0, 0.2], [0.3, 0.0, 0.2]])


def test_a_robot_that_starts_anew_begins_its_gait_anew(room: FloorPlan) -> None:
    places = np.array([[0.0, 0.0], [0.3, 0.0]])
    reader = GaitReader(GaitConfig(), map_plan(room, [Blocks.empty()] * 2))
    _walk(reader, places, 30, reset_at=29)
    assert reader.gait is not None
    fresh, going = reader.gait.phases
    begun = GaitReader(GaitConfig(), map_plan(room, [Blocks.empty()] * 2))
    _walk(begun, places, 1)
    assert begun.gait is not None
    np.testing.assert_allclose(fresh, begun.gait.phases[0])
    assert not np.allclose(going, begun.gait.phases[1])
