"""A prepared launch shows what the camera itself shows, bit for bit, time and again."""

import numpy as np
import pytest
import torch

from vinl.robot.cameras import LOCOMOTION_CAMERA
from vinl.robot.rotation import matrix_of
from vinl.sensing.depth import DepthCamera, PreparedRender
from vinl.world.boxes import Blocks
from vinl.world.mesh import floorplan_mesh
from vinl.world.readers import load_floorplans

PLANS = load_floorplans(["harbour_flat", "mill_loft"])
MESHES = [floorplan_mesh(plan, Blocks.empty()) for plan in PLANS]


@pytest.mark.parametrize("floor", [None, 0.0])
def test_shows_what_the_camera_shows(floor: float | None) -> None:
    depth = DepthCamera(MESHES, LOCOMOTION_CAMERA, floor=floor)
    render, rng = PreparedRender(depth, 3), np.random.default_rng(0)
    for world in ([0, 1, 0], [1, 1, 0]):
        position = rng.uniform([2, 2, 0.3], [4, 4, 0.5], (3, 3))
        turned = rng.normal(size=(3, 4)) * [1, 0.1, 0.1, 1]
        rotation = matrix_of(np, turned / np.linalg.norm(turned, axis=1, keepdims=True))
        expected = depth.render_poses(world, position, rotation)
        assert torch.equal(render(world, position, rotation), expected)
        assert expected.std() > 0.1


def test_only_depth_in_full_digits_is_prepared() -> None:
    depth = DepthCamera(MESHES, LOCOMOTION_CAMERA, dtype=torch.float16)
    with pytest.raises(ValueError, match="float32"):
        PreparedRender(depth, 1)
