"""What the student sees: the world that the evaluation has, a little off, late and with holes."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest
import torch

from vinl.loco.student_config import CameraConfig
from vinl.loco.terrain_cameras import TerrainCameras, patch_mesh, terrain_mesh
from vinl.robot.cameras import LOCOMOTION_CAMERA
from vinl.sensing.preparation import MARK
from vinl.sensing.sensor_config import SensorConfig, load_sensors
from vinl.world.grid import GROUND, GridFrame
from vinl.world.terrain import Terrain, TerrainConfig, build_terrain

EXACT = SensorConfig()
CAMERA = CameraConfig(width=16, height=16).record()


@pytest.fixture(scope="module")
def terrain() -> Terrain:
    nothing = {"slope": 0.0, "rough_slope": 0.0, "stairs_up": 0.0, "stairs_down": 0.0, "discrete": 0.0}
    return build_terrain(TerrainConfig(**nothing, blocks=1.0, levels=2, columns=1))


@pytest.fixture(scope="module")
def poses(terrain) -> torch.Tensor:
    """Trunks 0.9 m before blocks, any heading."""
    rng = np.random.default_rng(0)
    yaw = rng.uniform(-np.pi, np.pi, 6)
    middle = terrain.blocks.rows[:6, :2] - 0.9 * np.column_stack([np.cos(yaw), np.sin(yaw)])
    zero = np.zeros(6)
    turn = [np.cos(yaw / 2), zero, zero, np.sin(yaw / 2)]
    return torch.tensor(np.column_stack([middle, np.full(6, 0.36), *turn]), dtype=torch.float32)


def see(terrain, config, poses, camera=CAMERA, seed=1, steps=0) -> torch.Tensor:
    cameras = TerrainCameras(terrain_mesh(terrain), camera, config, len(poses), "cpu", seed)
    depth = cameras.look(poses, None)
    for _ in range(steps):
        depth = cameras.look(poses, torch.zeros(len(poses)))
    return depth


def test_the_student_sees_what_mujoco_has_in_its_way(terrain, poses, build_mujoco_boxes):
    """MuJoCo's rays against a plane and boxes, the ground of the evaluation."""
    model, data = build_mujoco_boxes(terrain.blocks.boxes() + terrain.tall)
    tx, ty = CAMERA.tan_half
    seen = see(terrain, EXACT, poses).float().numpy() * CAMERA.far
    wrong, hits = 0, set()
    for pose, image in zip(poses.numpy().astype(float), seen, strict=True):
        turn = np.zeros(9)
        mujoco.mju_quat2Mat(turn, pose[3:])
        trunk = turn.reshape(3, 3)
        place, camera = pose[:3] + trunk @ CAMERA.position, trunk @ CAMERA.rotation()
        for i, j in np.ndindex(image.shape):
            ray = camera @ [1.0, tx * (1 - (2 * j + 1) / 16), ty * (1 - (2 * i + 1) / 16)]
            geom = np.array([-1], np.int32)
            distance = mujoco.mj_ray(model, data, place, ray / np.linalg.norm(ray), None, 1, -1, geom, None)
            depth = min(distance / np.linalg.norm(ray), CAMERA.far) if distance >= 0 else CAMERA.far
            wrong += abs(depth - image[i, j]) > 0.004
            hits.add(int(geom[0]))
    assert wrong <= 0.003 * seen.size  # rays along an edge may pass on either side
    assert len(hits) > 5


def test_level_ground_is_coarse_and_rough_ground_is_not():
    frame = GridFrame(0.0, 0.0, 0.05, (65, 97))
    heights = np.zeros(frame.shape, np.float32)
    assert len(patch_mesh(heights, frame)[1]) == 2 * 2 * 3
    heights[3, 40] = 0.1
    vertices, faces = patch_mesh(heights, frame)
    assert len(faces) == 2 * 5 + 2 * 32 * 32 and vertices[:, 2].max() == np.float32(0.1)
    area = 0.0
    for a, b, c in vertices[faces][:, :, :2]:
        area += ((b - a)[0] * (c - a)[1] - (b - a)[1] * (c - a)[0]) / 2
    assert area == pytest.approx(64 * 96 * 0.05**2, rel=1e-4)  # no gap, no overlap, all normals up


def test_the_bare_ground_has_no_blocks(terrain):
    assert (terrain.ground.labels != GROUND).any()
    vertices, _ = terrain_mesh(terrain)
    ground = vertices[: len(vertices) - 8 * (len(terrain.blocks) + len(terrain.tall))]
    assert np.abs(ground[:, 2]).max() == 0.0


def test_a_late_image_is_the_last_one_and_an_episode_has_no_past(terrain, poses):
    mesh, late = terrain_mesh(terrain), replace(EXACT, delay=(0.02, 0.02))
    slow, prompt = (TerrainCameras(mesh, CAMERA, c, 6, "cpu", 1) for c in (late, EXACT))
    moved = poses.clone()
    moved[:, 2] += 0.05
    first, now = prompt.look(poses, None), prompt.look(moved, torch.zeros(6))
    assert torch.equal(slow.look(poses, None), first)
    assert slow.age.tolist() == pytest.approx([0.02] * 6) and not prompt.age.any()
    done = torch.zeros(6)
    done[2] = 1
    seen = slow.look(moved, done)
    fresh = done.bool()
    assert torch.equal(seen[fresh], now[fresh]) and torch.equal(seen[~fresh], first[~fresh])
    assert not torch.equal(first, now)


def test_errors_differ_from_robot_to_robot_and_repeat_with_the_seed(terrain, poses):
    same = poses[:1].expand(6, 7).contiguous()
    exact = see(terrain, EXACT, same)
    assert (exact == exact[0]).all() and exact.min() >= 0 and exact.max() <= 1 and exact.dtype == torch.float16
    angle = (-0.05, 0.05)
    for name, value in (("scale", 0.1), ("noise", 0.05), ("height", (-0.02, 0.02)), ("roll", angle), ("pitch", angle)):
        seen = see(terrain, replace(EXACT, **{name: value}), same)
        change = (seen - exact).float().abs().amax((1, 2))
        assert (change > 0).all() and len(change.unique()) > 1, name
    config = load_sensors("training")
    assert torch.equal(see(terrain, config, poses), see(terrain, config, poses))
    assert not torch.equal(see(terrain, config, poses), see(terrain, config, poses, seed=2))
    assert not torch.equal(see(terrain, config, poses), see(terrain, config, poses, steps=1))


def test_pixels_without_a_return_read_as_the_camera_says(terrain, poses):
    exact, holes = see(terrain, EXACT, poses), replace(EXACT, pixels=0.3)
    left = see(terrain, holes, poses, replace(CAMERA, missing="as_is"))
    lost = left != exact
    assert 0.1 < lost.float().mean() < 0.4 and (left[lost] == 1.0).all()
    filled, marked = (see(terrain, holes, poses, replace(CAMERA, missing=how)) for how in ("fill", "plane"))
    kept = ~lost & (exact < 1)  # a lost pixel is no other than a far one, left as it is
    assert torch.equal(filled[kept], exact[kept]) and torch.equal(marked[kept], exact[kept])
    assert (marked[lost] == MARK).all()
    off = [(image - exact).float()[lost].abs().mean() for image in (filled, left)]
    assert off[0] < 0.3 * off[1]


def test_resumed_cameras_see_the_same(terrain, poses):
    mesh, config = terrain_mesh(terrain), load_sensors("training")
    one, two = (TerrainCameras(mesh, CAMERA, config, 6, "cpu", 1) for _ in range(2))
    moved = poses + torch.tensor([0.0, 0.02, 0.03, 0, 0, 0, 0])
    one.look(poses, None)
    now = one.look(moved, torch.tensor([0, 1, 0, 0, 0, 0]))
    two.load_state(one.save_state())
    assert torch.equal(two.look(moved, None), now)
    done = torch.tensor([0, 0, 1, 0, 0, 0])
    assert torch.equal(two.look(poses, done), one.look(poses, done))
    prompt = TerrainCameras(mesh, CAMERA, EXACT, 6, "cpu", 1)
    with pytest.raises(ValueError, match="other errors"):
        prompt.load_state(one.save_state())


def test_the_default_camera_is_the_robots():
    assert CameraConfig().record() == replace(LOCOMOTION_CAMERA, missing="plane")
