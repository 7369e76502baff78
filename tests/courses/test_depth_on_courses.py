"""Locomotors with a camera, or blind, on blocks."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from vinl.chain.depth_cameras import DepthCameras
from vinl.courses.evaluate import compare_locomotors
from vinl.courses.grounds import GroundConfig, build_ground
from vinl.gait.observation import SENSED_TABLE
from vinl.policies.card import locomotion_card
from vinl.policies.depth_policy import DepthPolicy
from vinl.policies.policy import LocomotionPolicy
from vinl.policies.stepping_actor import SteppingActor
from vinl.robot.aliengo import home_qpos
from vinl.robot.cameras import LOCOMOTION_CAMERA
from vinl.world.grid import GridFrame, HeightField

FRAME = GridFrame(-2.0, -2.0, 0.1, (41, 41))


@pytest.mark.parametrize("sees", [True, False])
def test_students_walk_beside_others(sees: bool, trotting: LocomotionPolicy) -> None:
    torch.manual_seed(0)
    camera = replace(LOCOMOTION_CAMERA, missing="plane").describe() if sees else None
    network = SteppingActor(camera, hidden=8, layers=1, actor=(16,))
    student = DepthPolicy(network, locomotion_card("mine", network.describe(), table=SENSED_TABLE, camera=camera))
    results = compare_locomotors([student, trotting], "blocks", 2, 0.4)
    assert [len(r.records) for r in results] == [2, 2]
    assert results[0].records[0].steps == 20


def test_camera_sees_the_blocks_that_the_feet_meet() -> None:
    ground = build_ground(GroundConfig("blocks", 1.0, None, 0, 40.0, 2.0))
    x, y = ground.blocks.rows[0, :2]
    heading = 0.4
    qpos = np.stack([home_qpos(x - 0.8 * np.cos(heading), y - 0.8 * np.sin(heading), yaw=heading)])
    bare = build_ground(GroundConfig("blocks", 0.0, None, 0, 40.0, 2.0))
    near, far = (DepthCameras([g.mesh()], [0], LOCOMOTION_CAMERA).look(qpos)[0].numpy() for g in (ground, bare))
    middle = slice(LOCOMOTION_CAMERA.width // 2 - 4, LOCOMOTION_CAMERA.width // 2 + 4)
    assert (far - near)[:, middle].max() > 0.1 and (near <= far + 1e-5).all()
    slope = HeightField(np.tile(np.linspace(0, 2, 41, dtype=np.float32), (41, 1)), np.zeros((41, 41), np.uint8), FRAME)
    sloped = DepthCameras([replace(bare, field=slope).mesh()], [0], LOCOMOTION_CAMERA).look(
        np.stack([home_qpos(z=1.4)])
    )
    centre = LOCOMOTION_CAMERA.height // 2, LOCOMOTION_CAMERA.width // 2
    assert sloped[0][centre] < far[centre]
