"""What the camera saw stays where it lies: in place, in height, and while the robot turns and walks over it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch

from vinl.chain.depth_cameras import DepthCameras
from vinl.gait.local_map import POINTS, WALL
from vinl.gait.proprioception import feet_in_trunk, heading_axes, into_heading_frame, motion_of
from vinl.policies.elevation_map import CELL, NEAR, SIDE, UNSEEN, ElevationMap, MapState
from vinl.robot.aliengo import CONTROL_DT, FOOT_RADIUS, home_qpos
from vinl.robot.cameras import LOCOMOTION_CAMERA
from vinl.robot.rotation import rotate_inverse
from vinl.sensing.preparation import MARK, prepare_depth
from vinl.world.boxes import Boxes
from vinl.world.grid import GridFrame
from vinl.world.mesh import box_mesh, heightfield_mesh, join_meshes

CAMERA = replace(LOCOMOTION_CAMERA, missing="plane")
BAR = Boxes(np.array([[1.0, 0.0, 0.0, 0.2, 1.0, 0.0, 0.1]]))  # 0.9 to 1.1 m ahead, 1 m wide, 10 cm high
HEIGHT = 0.40


def cameras(boxes: Boxes) -> DepthCameras:
    frame = GridFrame(-4.0, -4.0, 8.0, (2, 2))
    return DepthCameras(
        [join_meshes(heightfield_mesh(np.zeros((2, 2), np.float32), frame), box_mesh(boxes))], [0], CAMERA
    )


def poses(steps: int, speed: float, yaw_rate: float) -> np.ndarray:
    """(steps, 19) of a robot that walks ahead and turns, evenly."""
    yaw = yaw_rate * CONTROL_DT * np.arange(steps)
    middle = yaw - 0.5 * yaw_rate * CONTROL_DT
    x, y = (np.cumsum(np.r_[0.0, speed * CONTROL_DT * wave(middle[1:])]) for wave in (np.cos, np.sin))
    return np.stack([home_qpos(*at) for at in zip(x, y, np.full(steps, HEIGHT), yaw, strict=True)])


def truth(qpos: np.ndarray, margin: float) -> tuple[np.ndarray, np.ndarray]:
    """(741,) which of the planner's points lie on the bar by at least a margin, and which as far beside it."""
    yaw = 2 * np.arctan2(qpos[6], qpos[3])
    c, s = np.cos(yaw), np.sin(yaw)
    at = POINTS @ np.array([[c, s], [-s, c]]) + qpos[:2]
    away = np.abs(at - [1.0, 0.0]) - [0.1, 0.5]
    return (away < -margin).all(1), (away > margin).any(1)


def walk(
    path: np.ndarray,
    speed: float,
    yaw_rate: float,
    spoil=lambda image: image,
    boxes: Boxes = BAR,
    late: int = 0,
    age: float | None = None,
) -> tuple[ElevationMap, MapState]:
    """The map after a path: images are so many control steps late, and said to be of an age [s]."""
    told = None if age is None else torch.tensor([age])
    sees, elevation = cameras(boxes), ElevationMap(CAMERA)
    state = elevation.start(1)
    motion = torch.tensor([[speed * CONTROL_DT, 0.0, 0.0, yaw_rate * CONTROL_DT]])
    for k, qpos in enumerate(path):
        down = rotate_inverse(np, qpos[None, 3:7], np.array([[0.0, 0.0, -1.0]]))
        axes = heading_axes(torch, torch.from_numpy(down).float())
        feet = into_heading_frame(axes, feet_in_trunk(torch, torch.from_numpy(qpos[None, 7:]).float()))
        assert feet[..., 2].mean() == pytest.approx(FOOT_RADIUS - HEIGHT, abs=0.05)
        state = elevation.move(state, motion) if k else state
        image = spoil(prepare_depth(CAMERA, sees.look(path[None, max(k - late, 0)])))
        state = elevation.see(state, image, axes, torch.tensor([-HEIGHT]), told)
    return elevation, state


@pytest.mark.parametrize(("speed", "yaw_rate"), [(0.5, 0.0), (0.4, 0.5), (0.4, -0.4)])
def test_a_bar_stays_where_it_lies(speed: float, yaw_rate: float) -> None:
    path = poses(125, speed, yaw_rate)
    elevation, state = walk(path, speed, yaw_rate)
    heights = elevation.read(state)[0].numpy()
    on, off = truth(path[-1], 0.04)
    seen = POINTS[:, 0] < NEAR - 0.1
    assert (on & seen).sum() > 10  # part of it lies under the robot, where no camera looks
    assert np.median(heights[on & seen]) == pytest.approx(0.1, abs=0.01)
    assert (np.abs(heights[on & seen] - 0.1) < 0.02).mean() > 0.9
    assert (heights[off] == 0).mean() > 0.97


def test_a_late_image_shows_what_was_there_when_it_was_taken() -> None:
    """60 ms at 0.5 m/s and 0.5 rad/s are 3 cm and 1.7 deg."""
    path = poses(90, 0.5, 0.5)
    elevation, prompt = walk(path, 0.5, 0.5)
    late, unsaid = (walk(path, 0.5, 0.5, late=3, age=age)[1] for age in (0.06, None))
    torch.testing.assert_close(late.pose, prompt.pose)
    maps = [elevation.read(state)[0].numpy() > 0.05 for state in (prompt, late, unsaid)]
    assert maps[0].sum() > 50
    wrong, off = ((shown != maps[0]).sum() for shown in maps[1:])
    assert wrong <= 0.1 * maps[0].sum() < 0.3 * maps[0].sum() <= off


def test_a_robot_has_not_stood_before_it_began() -> None:
    begun = np.repeat(poses(1, 0.0, 0.0), 2, 0)
    (elevation, prompt), (_, late) = (walk(begun, 0.0, 0.0, age=age) for age in (None, 0.1))
    assert (prompt.heights > 0.05).any()
    torch.testing.assert_close(late.heights, prompt.heights)
    assert late.recent.any() and not elevation.forget(late, torch.tensor([True])).recent.any()


def test_a_bar_is_as_deep_as_it_is() -> None:
    """On average over where it lies among the cells: a bar that looks deeper is not straddled."""
    counted, true = 0, 0
    for steps in range(70, 100, 2):  # it moves by 1.6 cm among cells of 5 cm
        path = poses(steps, 0.4, 0.0)
        elevation, state = walk(path, 0.4, 0.0)
        middle = np.abs(POINTS[:, 1]) < 0.3
        counted += (elevation.read(state)[0].numpy()[middle] > 0.05).sum()
        true += truth(path[-1], 0.0)[0][middle].sum()
    assert 0.85 * true < counted < 1.12 * true


def test_pixels_without_a_return_and_a_tilted_camera_change_little() -> None:
    random = torch.Generator().manual_seed(0)
    path = poses(100, 0.5, 0.0)

    def spoil(image: torch.Tensor) -> torch.Tensor:
        return torch.where(torch.rand(image.shape, generator=random) < 0.3, MARK, image * 1.01)

    elevation, state = walk(path, 0.5, 0.0, spoil)
    heights = elevation.read(state)[0].numpy()
    on, off = truth(path[-1], 0.04)
    assert (np.abs(heights[on] - 0.1) < 0.025).mean() > 0.8
    assert (heights[off] == 0).mean() > 0.95


def test_ground_left_behind_is_forgotten_and_a_fresh_robot_knows_nothing() -> None:
    elevation, state = walk(poses(2, 0.5, 0.0), 0.5, 0.0)
    shown = (state.heights > 0.5 * UNSEEN).sum()
    still = elevation.move(state, torch.zeros(1, 4))
    torch.testing.assert_close(still.heights, state.heights)
    for _ in range(60):  # 3 m on
        still = elevation.move(still, torch.tensor([[0.05, 0.0, 0.0, 0.0]]))
    assert shown > 100 and (still.heights == UNSEEN).all() and still.heights.shape == (1, SIDE**2)
    fresh = elevation.forget(state, torch.tensor([True]))
    assert (fresh.heights == UNSEEN).all() and not elevation.read(fresh).any() and not fresh.pose.any()


@pytest.mark.parametrize("ulp", [-2, 0, 2])
def test_a_point_is_in_a_cell_of_the_map_however_a_device_rounds(ulp: int, monkeypatch) -> None:
    monkeypatch.setattr("vinl.policies.elevation_map._PER_SIDE", (1 / SIDE) * (1 + ulp * 2.0**-24))
    cells = np.arange(-20_000, 20_000)  # 500 m to all sides
    at = torch.from_numpy((cells + 0.5) * CELL).float()[None]
    for x, y in ((at, torch.zeros_like(at)), (torch.zeros_like(at), at)):
        index = ElevationMap._index(torch.zeros(1, 3), x, y)[0].numpy()
        column, row = (torch.floor(part[0] / CELL).int().numpy() % SIDE for part in (x, y))
        np.testing.assert_array_equal(index, column * SIDE + row)


def test_motion_of_the_trunk_is_what_it_reckons_with() -> None:
    """At rest but for a turn, the velocity of the trunk's frame is turned by half of it."""
    axes = torch.eye(3)[None]
    motion = motion_of(torch, axes, torch.tensor([[0.5, 0.0, 0.0]]), torch.tensor([[0.0, 0.0, 1.0]]))
    elevation = ElevationMap(CAMERA)
    state = elevation.start(1)
    for _ in range(50):
        state = elevation.move(state, motion)
    assert state.pose[0].tolist() == pytest.approx([0.5 * np.sin(1.0), 0.5 * (1 - np.cos(1.0)), 1.0], abs=1e-4)


def test_a_wall_that_is_walked_past_stays_a_wall() -> None:
    wall = Boxes(np.array([[1.0, 0.45, 0.0, 2.0, 0.1, 0.0, 2.5]]))  # 0.4 m to the left
    elevation, state = walk(poses(150, 0.5, 0.0), 0.5, 0.0, boxes=wall)
    surface = (np.abs(POINTS[:, 0]) < 0.4) & np.isclose(POINTS[:, 1], 0.4)
    heights = elevation.read(state)[0].numpy()
    assert (heights[surface] > WALL).all()
    assert (heights[POINTS[:, 1] < 0.3] == 0.0).all()
