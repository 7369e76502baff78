"""The cameras see walls, blocks and floor where they are, for the robots that live, and never the robot."""

from dataclasses import replace

import numpy as np
import pytest

from vinl.chain.depth_cameras import DepthCameras, open_depth_cameras
from vinl.robot.aliengo import home_qpos
from vinl.robot.cameras import LOCOMOTION_CAMERA, NAVIGATION_CAMERA, Camera
from vinl.robot.rotation import matrix_of
from vinl.sensing.depth import DepthCamera
from vinl.world.boxes import Blocks
from vinl.world.floorplan import FloorPlan
from vinl.world.mesh import floorplan_mesh

LEVEL = replace(NAVIGATION_CAMERA, pitch_down=0.0, width=9, height=9)
BLOCK = Blocks(np.array([[6.0, 3.0, 0.0, 0.2, 0.5, 0.5]]))
NONE = Blocks.empty()


def stand(x: float, y: float, yaw: float = 0.0) -> np.ndarray:
    return home_qpos(x, y, 0.38, yaw)


def test_walls_and_blocks_are_where_they_are(two_rooms: FloorPlan) -> None:
    """Room two reaches to x = 9 m less half a wall; the camera is 0.32 m before the trunk's middle."""
    cameras = open_depth_cameras(two_rooms, [NONE, BLOCK, NONE], LEVEL)
    depth = cameras.look(np.stack([stand(5.0, 3.0)] * 2 + [stand(7.0, 3.0, np.pi)]))
    assert depth.shape == (3, 9, 9)
    assert depth[0, 4, 4] == pytest.approx(9 - 0.05 - 5.32, abs=1e-3)
    assert depth[1, 4, 4] == pytest.approx(5.9 - 5.32, abs=1e-3)
    assert depth[2, 4, 4] == pytest.approx(6.68 - 0.05, abs=1e-3)  # through the door to the far wall
    assert depth[0, 8, 4] == pytest.approx(0.38 / (LEVEL.tan_half[1] * 8 / 9), abs=1e-3)  # the floor


def test_robots_do_not_see_themselves_nor_others(two_rooms: FloorPlan) -> None:
    """Looking down past the fore legs, nothing is nearer than the floor in any pose of the legs."""
    poses = np.stack([stand(6.5, 3.0), stand(6.9, 3.0, np.pi)])
    poses[:, 7:] += 0.8
    cameras = open_depth_cameras(two_rooms, [NONE, NONE], LOCOMOTION_CAMERA)
    depth = cameras.look(poses)
    alone = open_depth_cameras(two_rooms, [NONE], LOCOMOTION_CAMERA).look(poses[:1])
    np.testing.assert_array_equal(depth[0], alone[0])
    down = np.sin(LOCOMOTION_CAMERA.pitch_down) + np.cos(LOCOMOTION_CAMERA.pitch_down) * LOCOMOTION_CAMERA.tan_half[1]
    assert depth.min() > 0.95 * 0.38 / down


def test_a_ceiling_is_seen_if_there_is_one(two_rooms: FloorPlan) -> None:
    poses = stand(5.0, 3.0)[None]
    up = replace(LEVEL, pitch_down=-np.radians(60))
    bare = open_depth_cameras(two_rooms, [NONE], up).look(poses)
    under = open_depth_cameras(two_rooms, [NONE], up, ceiling=2.5).look(poses)
    assert bare[0, 0, 4] == up.far
    z = 0.38
    assert under[0, 4, 4] == pytest.approx((2.5 - z) / np.sin(np.radians(60)), abs=1e-3)


@pytest.mark.parametrize("ceiling", [None, 2.4])
@pytest.mark.parametrize("camera", [LOCOMOTION_CAMERA, NAVIGATION_CAMERA], ids=lambda camera: camera.name)
def test_what_is_left_out_of_the_mesh_is_never_seen(
    two_rooms: FloorPlan, camera: Camera, ceiling: float | None
) -> None:
    """The same images as with every triangle of the home, the floor's too, from a trunk that sways and tumbles."""
    rng = np.random.default_rng(0)
    poses = np.stack([stand(x, y, yaw) for x, y, yaw in rng.uniform([1, 2, -3], [8.5, 5.5, 3], (40, 3))])
    poses[:, 2] += rng.uniform(-0.2, 0.3, 40)
    tilt = rng.normal(size=(40, 4)) * [0, 0.2, 0.2, 0] + poses[:, 3:7]
    poses[:, 3:7] = tilt / np.linalg.norm(tilt, axis=1, keepdims=True)
    blocks = Blocks(np.vstack([BLOCK.rows, [[3.0, 3.0, 0.4, 0.2, 0.5, 0.15]]]))
    seen = open_depth_cameras(two_rooms, [blocks] * 40, camera, ceiling).look(poses)
    whole = DepthCamera([floorplan_mesh(two_rooms, blocks, ceiling)], camera)
    expected = whole.render(np.zeros(40, int), poses[:, :3], matrix_of(np, poses[:, 3:7]))
    off = (seen - expected).abs().numpy()
    assert (off > 1e-4).mean() < 1e-4  # a ray along an edge may fall on either side
    assert expected.min() < 0.5 and seen.max() > 0.8 * camera.far


def test_rows_that_ended_keep_their_image_and_do_not_matter(two_rooms: FloorPlan) -> None:
    blocks = [BLOCK, NONE, BLOCK]
    first = np.stack([stand(5.0, 3.0)] * 3)
    second = first + 0.0
    second[:, 0] += 0.3
    cameras = open_depth_cameras(two_rooms, blocks, LEVEL)
    before = cameras.look(first).clone()
    after = cameras.look(second, [2, 0])
    whole = open_depth_cameras(two_rooms, blocks, LEVEL).look(second)
    np.testing.assert_array_equal(after[1], before[1])
    np.testing.assert_array_equal(after[[0, 2]], whole[[0, 2]])
    second[1] = np.nan
    np.testing.assert_array_equal(cameras.look(second, [0, 2])[[0, 2]], whole[[0, 2]])
    np.testing.assert_array_equal(cameras.look(second, [])[[0, 2]], whole[[0, 2]])


def test_homes_without_clutter_share_a_mesh(two_rooms: FloorPlan, monkeypatch: pytest.MonkeyPatch) -> None:
    built = []
    monkeypatch.setattr(
        DepthCameras, "__init__", lambda self, meshes, worlds, *_, **__: built.append((len(meshes), worlds))
    )
    open_depth_cameras(two_rooms, [NONE, BLOCK, NONE, BLOCK], LEVEL)
    assert built == [(3, [0, 1, 0, 2])]
