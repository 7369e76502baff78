import math
from dataclasses import replace

import mujoco
import numpy as np
import pytest
import torch
from scipy.spatial.transform import Rotation

from vinl.config.errors import InputError
from vinl.robot.cameras import LOCOMOTION_CAMERA, NAVIGATION_CAMERA, Camera
from vinl.sensing.depth import DepthCamera
from vinl.world.boxes import Boxes
from vinl.world.grid import GridFrame
from vinl.world.mesh import box_mesh, floor_mesh, join_meshes

GROUND = floor_mesh(GridFrame(-50.0, -50.0, 1.0, (101, 101)))
LEVEL = Camera("level", (0.0, 0.0, 0.0), 0.0, math.radians(90), 32, 24, 8.0)
EYE = np.eye(3)[None]


def slopes(camera: Camera) -> tuple[np.ndarray, np.ndarray]:
    """Left and up of every pixel's ray for one metre along the optical axis."""
    tx, ty = camera.tan_half
    left = tx * (1 - (2 * np.arange(camera.width) + 1) / camera.width)
    up = ty * (1 - (2 * np.arange(camera.height) + 1) / camera.height)
    return left[None, :], up[:, None]


def ground_depth(camera: Camera, height: float, rotation: np.ndarray) -> np.ndarray:
    """Planar depth of level ground from a camera at a height, by hand."""
    left, up = slopes(camera)
    down = -(rotation[2, 0] + rotation[2, 1] * left + rotation[2, 2] * up)
    depth = np.where(down > 1e-9, height / np.where(down > 1e-9, down, 1.0), np.inf)
    return np.minimum(depth, camera.far)


@pytest.mark.parametrize("camera", [LOCOMOTION_CAMERA, NAVIGATION_CAMERA, LEVEL], ids=lambda c: c.name)
@pytest.mark.parametrize("roll, pitch, yaw", [(0, 0, 0), (0, 0.2, 1.0), (0.3, -0.1, -2.0)])
def test_ground_under_a_tilted_trunk(camera, roll, pitch, yaw):
    trunk = Rotation.from_euler("ZYX", [yaw, pitch, roll]).as_matrix()
    position = np.array([1.0, -2.0, 0.4])
    depth = DepthCamera([GROUND], camera).render([0], position[None], trunk[None])[0].numpy()
    height = (position + trunk @ camera.position)[2]
    assert np.allclose(depth, ground_depth(camera, height, trunk @ camera.rotation()), rtol=2e-4)


def test_locomotion_camera_sees_the_ground_before_the_feet():
    # 30 deg down: the middle of the image lies 0.38 / tan(30 deg) ahead, 0.38 / sin(30 deg) away.
    camera = replace(LOCOMOTION_CAMERA, width=65, height=37)
    depth = DepthCamera([GROUND], camera).render([0], [[0, 0, 0.38]], EYE)[0]
    assert depth[18, 32] == pytest.approx(0.76, abs=1e-3)
    assert depth[-1, 32] < depth[0, 32]


def test_box_ahead_is_flat_in_depth_and_left_is_left():
    wall = box_mesh(Boxes(np.array([[3.1, 0, 0, 0.2, 40, -20, 20], [1.0, 0.5, 0, 0.2, 0.4, -0.2, 0.3]])))
    depth = DepthCamera([wall], LEVEL).render([0], [[0, 0, 0]], EYE)[0].numpy()
    left, up = slopes(LEVEL)
    near = (np.abs(0.9 * left - 0.5) < 0.2) & (0.9 * up > -0.2) & (0.9 * up < 0.3)
    assert near.sum() > 10
    # The face in front is planar: the same depth wherever in the image it is seen. Its sides are farther.
    assert np.allclose(depth[near], 0.9, atol=1e-5)
    assert np.allclose(depth[:, LEVEL.width // 2 + 1 :], 3.0, atol=1e-5)


def test_nothing_hit_is_far_and_so_is_what_lies_beyond():
    away = box_mesh(Boxes(np.array([[20.0, 0, 0, 1, 1, -5, 5]])))
    behind = box_mesh(Boxes(np.array([[-2.0, 0, 0, 1, 1, -5, 5]])))
    depth = DepthCamera([away, behind], LEVEL).render([0, 1], np.zeros((2, 3)), np.repeat(EYE, 2, 0))
    assert (depth == 8.0).all()


def test_many_worlds_in_one_launch():
    walls = [box_mesh(Boxes(np.array([[d + 0.5, 0, 0, 1, 30, -15, 15]]))) for d in (1.0, 2.0, 3.0)]
    world = np.array([2, 0, 1, 1, 0])
    depth = DepthCamera(walls, LEVEL).render(world, np.zeros((5, 3)), np.repeat(EYE, 5, 0)).numpy()
    assert np.allclose(depth, (world + 1.0)[:, None, None], atol=1e-5)


def test_half_precision_is_the_same_picture():
    args = [0], [[0, 0, 0.4]], EYE
    full = DepthCamera([GROUND], LEVEL).render(*args)
    half = DepthCamera([GROUND], LEVEL, dtype=torch.float16).render(*args)
    assert half.dtype == torch.float16 and torch.equal(full.half(), half)


def test_out_is_written_in_place():
    camera = DepthCamera([GROUND], LEVEL)
    down = Rotation.from_euler("y", 90, degrees=True).as_matrix()
    out = torch.zeros(2, 24, 32)
    again = camera.render_poses([0, 0], [[0, 0, 1.0], [0, 0, 2.0]], np.stack([down, down]), out=out)
    assert again is out
    assert torch.allclose(out[0], torch.tensor(1.0)) and torch.allclose(out[1], torch.tensor(2.0))


def test_agrees_with_mujoco_rays(build_mujoco_boxes):
    """Random boxes, random camera poses, against MuJoCo's own exact ray and box intersection."""
    rng = np.random.default_rng(3)
    n = 25
    boxes = Boxes(
        np.column_stack(
            [rng.uniform(-4, 4, (n, 2)), rng.uniform(-3, 3, n), rng.uniform(0.1, 1.5, (n, 2)), rng.uniform(0, 1, n),
             rng.uniform(1.1, 2, n)]
        )
    )  # fmt: skip
    model, data = build_mujoco_boxes(boxes)
    camera = Camera("test", (0.1, 0.02, 0.03), 0.2, math.radians(80), 16, 12, 6.0)
    k = 12
    positions = np.column_stack([rng.uniform(-4, 4, (k, 2)), rng.uniform(0.2, 2.4, k)])
    # Outside every box: from inside, the two libraries may see different faces.
    u = boxes.contain(positions[:, :2]) & (positions[:, 2] < 2.2)
    positions[u.any(0), 2] = 2.3
    rotations = Rotation.random(k, random_state=4).as_matrix()
    depth = DepthCamera([join_meshes(box_mesh(boxes), GROUND)], camera).render(np.zeros(k, int), positions, rotations)
    left, up = slopes(camera)
    rays = np.stack(np.broadcast_arrays(1.0, left, up), -1)
    expected = np.empty((k, camera.height, camera.width))
    geom = np.zeros(1, np.int32)
    for image in range(k):
        origin = positions[image] + rotations[image] @ camera.position
        for i in range(camera.height):
            for j in range(camera.width):
                ray = rotations[image] @ camera.rotation() @ rays[i, j]
                t = mujoco.mj_ray(model, data, origin, ray, None, 1, -1, geom)
                expected[image, i, j] = min(t, camera.far) if t >= 0 else camera.far
    difference = np.abs(depth.numpy() - expected)
    # A ray along an edge may hit or miss by rounding.
    assert (difference < 1e-3).mean() > 0.999
    assert (expected < camera.far).mean() > 0.4


@pytest.mark.parametrize(
    "call, words",
    [
        (lambda: DepthCamera([], LEVEL), "at least one mesh"),
        (lambda: DepthCamera([(np.eye(3), np.array([[0, 1, 5]]))], LEVEL), "names no vertex"),
        (lambda: DepthCamera([(np.eye(3) * np.nan, np.array([[0, 1, 2]]))], LEVEL), "not finite"),
        (lambda: DepthCamera([(np.eye(3), np.zeros((0, 3), int))], LEVEL), "faces"),
        (lambda: DepthCamera([GROUND], LEVEL, dtype=torch.float64), "float16"),
        (lambda: DepthCamera([GROUND], LEVEL).render([1], [[0, 0, 0]], EYE), "out of range"),
        (lambda: DepthCamera([GROUND], LEVEL).render([0, 0], [[0, 0, 0]], EYE), "positions"),
    ],
)
def test_bad_input_says_what_is_wrong(call, words):
    with pytest.raises(InputError, match=words):
        call()


def test_no_gpu_is_a_clear_error(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(torch.cuda, "is_available", lambda: False)
    with pytest.raises(InputError, match="use device cpu"):
        DepthCamera([GROUND], LEVEL, device="cuda")


def test_no_robots_no_pictures():
    depth = DepthCamera([GROUND], LEVEL).render(np.zeros(0, int), np.zeros((0, 3)), np.zeros((0, 3, 3)))
    assert depth.shape == (0, 24, 32)
