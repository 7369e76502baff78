"""What a navigator has seen stays where it lies, and the path on it leads around walls and out of dead ends."""

from __future__ import annotations

import math

import numpy as np
import pytest
import torch

from vinl.chain.depth_cameras import DepthCameras
from vinl.policies.grid_path import AHEAD, PLAN_SIZE, plan_path
from vinl.policies.nav_actor import NavActor
from vinl.policies.occupancy_grid import CELL, MOUNT_HEIGHT, PASSABLE, SIDE, GridState, OccupancyGrid, cell_of, index_of
from vinl.robot.aliengo import home_qpos
from vinl.robot.cameras import NAVIGATION_CAMERA
from vinl.sensing.preparation import prepare_depth
from vinl.world.boxes import Boxes
from vinl.world.grid import GridFrame
from vinl.world.mesh import box_mesh, heightfield_mesh, join_meshes

NOBODY, ALL = torch.tensor([False]), torch.tensor([True])
HALF = torch.tensor([0.4])  # m/s
GRID = {"camera": {**NAVIGATION_CAMERA.describe(), "width": 32, "height": 24}, "forward_speed": [-0.3, 0.8]}
WALL = (3.0, 0.0, 0.0, 0.2, 4.0, 0.0, 2.0)  # 2.9 to 3.1 m ahead, 4 m wide, 2 m high
BLOCK = (1.5, 0.0, 0.0, 0.2, 1.0, 0.0, 0.2)  # of clutter, to be stepped over


def look(boxes: list[tuple[float, ...]], poses: list[tuple[float, float, float]]) -> GridState:
    """The grid after images from poses (x, y, yaw)."""
    frame = GridFrame(-8.0, -8.0, 16.0, (2, 2))
    mesh = join_meshes(heightfield_mesh(np.zeros((2, 2), np.float32), frame), box_mesh(Boxes(np.array(boxes))))
    cameras, grid = DepthCameras([mesh], [0], NAVIGATION_CAMERA), OccupancyGrid(NAVIGATION_CAMERA)
    state, before = grid.start(1), poses[0]
    for k, pose in enumerate(poses):
        image = prepare_depth(NAVIGATION_CAMERA, cameras.look(home_qpos(*pose[:2], MOUNT_HEIGHT, pose[2])[None]))
        c, s = math.cos(before[2]), math.sin(before[2])
        x, y = pose[0] - before[0], pose[1] - before[1]
        step = torch.tensor([[c * x + s * y, c * y - s * x, pose[2] - before[2]]])
        state, before = grid.see(state, image, HALF, step, ALL if k == 0 else NOBODY), pose
    return state


def cells(state: GridState, places: list[tuple[float, float]]) -> list[float]:
    """Of places in the frame of the first pose."""
    return state.cells[0, 0, index_of(*torch.tensor(places).unbind(-1))].tolist()


def test_walls_are_occupied_what_lies_before_them_is_free_and_clutter_is_nothing() -> None:
    state = look([WALL, BLOCK], [(0.0, 0.0, 0.0)] * 4)
    assert min(cells(state, [(2.9, y) for y in (-1.5, -0.6, 0.1, 0.9, 1.6)])) > 0.5
    assert max(cells(state, [(1.5, 0.1), (2.0, -0.8), (2.5, 1.0), (0.1, 0.1)])) < -0.5
    assert cells(state, [(4.0, 0.1), (-1.0, 0.1)]) == [0.0, 0.0]


def test_walls_stay_where_they_are_while_the_robot_walks_and_turns() -> None:
    path = [(0.05 * k, 0.03 * k, 0.05 * k) for k in range(30)]
    state = look([WALL], path)
    assert state.pose[0, 0].tolist() == pytest.approx([1.45, 0.87, 1.45], abs=1e-5)
    assert min(cells(state, [(2.9, y) for y in (-0.9, 0.1, 0.9, 1.6)])) > 0.5
    assert max(cells(state, [(2.2, -0.4), (2.2, 0.4), (2.2, 1.2)])) < -0.5


def test_a_robot_that_begins_anew_knows_nothing_of_before() -> None:
    state = look([WALL], [(0.0, 0.0, 0.0)] * 3)
    blank = torch.zeros(1, NAVIGATION_CAMERA.height, NAVIGATION_CAMERA.width)
    fresh = OccupancyGrid(NAVIGATION_CAMERA).see(state, blank, HALF, torch.tensor([[0.4, 0.0, 0.3]]), ALL)
    assert not fresh.pose.any()
    assert (fresh.cells[0, 0] != 0).nonzero().flatten().tolist() == [int(index_of(*torch.zeros(2)))]


def test_ground_left_behind_is_forgotten() -> None:
    state = look([WALL], [(0.0, 0.0, 0.0)] * 3)
    grid, blank = OccupancyGrid(NAVIGATION_CAMERA), torch.zeros(1, NAVIGATION_CAMERA.height, NAVIGATION_CAMERA.width)
    for _ in range(30):
        state = grid.see(state, blank, HALF, torch.tensor([[-0.4, 0.0, 0.0]]), NOBODY)
    assert not (state.cells > 0).any()


def test_what_holds_the_robot_unseen_is_walked_around_and_tried_again_later() -> None:
    grid, state = OccupancyGrid(NAVIGATION_CAMERA), drawn([(0.3, 0.3, 0.8, 6.0), (0.3, -3.0, 0.8, -0.3)])  # a gap ahead
    open_, goal = torch.ones(1, NAVIGATION_CAMERA.height, NAVIGATION_CAMERA.width), torch.tensor([[4.0, 0.0]])
    assert plan_path(state, goal)[0, 2] > 0.9
    stood = torch.zeros(1, 3)
    walks_past = grid.see(state, open_, HALF, torch.tensor([[0.07, 0.0, 0.0]]), NOBODY)
    waits = grid.see(state, open_, torch.tensor([0.1]), stood, NOBODY)
    assert not walks_past.bumps.any() and not waits.bumps.any()
    for _ in range(3):
        state = grid.see(state, open_, HALF, stood, NOBODY)
    assert plan_path(state, goal)[0, 2] < 0.5
    for _ in range(40):
        state = grid.see(state, open_, torch.zeros(1), stood, NOBODY)
    assert plan_path(state, goal)[0, 2] > 0.9


def test_a_door_whose_frame_is_touched_is_closed_only_where_that_goes_on() -> None:
    grid, blank = OccupancyGrid(NAVIGATION_CAMERA), torch.zeros(1, NAVIGATION_CAMERA.height, NAVIGATION_CAMERA.width)
    frame, stood = drawn([(0.4, 0.25, 0.6, 1.0)]), torch.zeros(1, 3)
    marked = []
    for state in (frame, drawn([])):
        for _ in range(3):
            state = grid.see(state, blank, HALF, stood, NOBODY)
            marked.append(bool((state.bumps > PASSABLE).any()))
    assert marked == [False, False, True, True, True, True]


def test_what_holds_a_robot_that_walks_back_is_behind_it() -> None:
    grid, state = OccupancyGrid(NAVIGATION_CAMERA), drawn([])
    blank = torch.zeros(1, NAVIGATION_CAMERA.height, NAVIGATION_CAMERA.width)
    state = grid.see(state, blank, torch.tensor([-0.3]), torch.zeros(1, 3), NOBODY)
    held = state.bumps[0, 0].nonzero().flatten().tolist()
    assert set(held) == {int(index_of(*torch.tensor([-0.45, y]).unbind(-1))) for y in (-0.24, -0.12, 0.0, 0.12, 0.24)}


def drawn(walls: list[tuple[float, float, float, float]]) -> GridState:
    """A grid on which rectangles (x, y from, x, y to) [m] are occupied and all else is free."""
    state = OccupancyGrid.start(1)
    state.cells.fill_(-1.0)
    middles = (torch.arange(SIDE) - SIDE // 2 + 0.5) * CELL
    places = torch.cartesian_prod(middles, middles)
    x, y = places.T
    for x0, y0, x1, y1 in walls:
        inside = (x > x0) & (x < x1) & (y > y0) & (y < y1)
        state.cells[0, 0, index_of(*places[inside].unbind(-1))] = 1.0
    return state


def test_without_walls_the_path_is_straight() -> None:
    for goal in ((4.0, 0.0), (3.0, 3.0), (30.0, 0.0), (0.0, -20.0)):
        told = plan_path(drawn([]), torch.tensor([goal]))[0].numpy()
        length = math.hypot(*goal)
        assert len(told) == PLAN_SIZE
        for k in range(len(AHEAD)):
            assert told[2 * k : 2 * k + 2] @ np.array(goal) / length > 0.97
        assert told[-2] == pytest.approx(min(length / 10, 4), abs=0.06)
        assert abs(told[-1]) < 0.1


def test_the_path_leads_around_a_wall_and_says_how_much_longer_it_is() -> None:
    told = plan_path(drawn([(2.0, -3.0, 2.5, 6.0)]), torch.tensor([[5.0, 0.0]]))[0].numpy()
    assert told[5] < -0.7  # to the right, where the wall ends sooner
    around = 2 * math.hypot(2.3, 3.2)
    assert around < 10 * told[-2] < around + 2.5  # it costs more beside the wall
    assert 5 * told[-1] == pytest.approx(10 * told[-2] - 5, abs=1e-4)


def test_no_path_slips_through_an_oblique_wall() -> None:
    state = drawn([])
    for k in range(-20, 21):  # a diagonal of cells that touch by their corners alone
        state.cells[0, 0, index_of(*torch.tensor([2.0 + k * CELL + 0.01, k * CELL + 0.01]).unbind(-1))] = 1.0
    told = plan_path(state, torch.tensor([[4.0, 0.0]]))[0].numpy()
    assert 10 * told[-2] > 6.5  # around one of its ends, 3 m aside


def test_a_dead_end_is_left_although_the_goal_lies_behind_its_end() -> None:
    room = [(-1.5, 1.0, 3.0, 1.5), (-1.5, -1.5, 3.0, -1.0), (2.5, -1.5, 3.0, 1.5)]
    told = plan_path(drawn(room), torch.tensor([[5.0, 0.0]]))[0].numpy()
    assert told[0] < -0.7  # back to where it is open


def test_a_turned_robot_is_told_in_its_own_frame() -> None:
    state = drawn([(2.0, -3.0, 2.5, 6.0)])
    state.pose[0, 0, 2] = math.pi / 2  # the goal is now to the right, the wall ends behind the robot
    told = plan_path(state, torch.tensor([[0.0, -5.0]]))[0].numpy()
    assert told[4] < -0.7


def test_a_step_at_a_time_is_the_same_as_all_at_once() -> None:
    torch.manual_seed(0)
    actor = NavActor("cnn", 24, 32, 16, 8, 16, 1, previous=5, grid=GRID)
    depth, vector = torch.rand(5, 3, 24, 32), torch.randn(5, 3, 8)
    fresh = torch.zeros(5, 3, dtype=torch.bool)
    fresh[0], fresh[3, 1] = True, True
    with torch.no_grad():
        at_once, last = actor(depth, vector, actor.initial_state(3), fresh)
        state, actions = actor.initial_state(3), []
        for k in range(5):
            action, state = actor(depth[k : k + 1], vector[k : k + 1], state, fresh[k : k + 1])
            actions.append(action)
    torch.testing.assert_close(torch.cat(actions), at_once)
    for a, b in zip(state, last, strict=True):
        torch.testing.assert_close(a, b)


def test_cells_of_places_beside_the_origin() -> None:
    assert cell_of(torch.tensor([[-0.01, 0.01]])).tolist() == [[-1, 0]]
