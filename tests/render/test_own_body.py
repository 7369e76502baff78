"""The robot does not see itself: its body is not in the depth camera's world. Of the real view its legs must be no
part, or so little that a robot can take them out (docs/deploy.md). The cameras are built into the trunk's nose, whose
shell has an opening there."""

from dataclasses import replace

import numpy as np
import pytest

from vinl.render.scene import RobotShape
from vinl.robot.aliengo import home_qpos
from vinl.robot.cameras import LOCOMOTION_CAMERA, NAVIGATION_CAMERA
from vinl.sensing.depth import DepthCamera
from vinl.world.mesh import join_meshes

POSES, SPREAD = 40, 0.6


@pytest.fixture(scope="module")
def bodies() -> list[tuple[np.ndarray, np.ndarray]]:
    """The surface of hips and legs in the trunk frame: default pose, legs stretched forward, and joints +-0.6 rad."""
    shape, rng = RobotShape(), np.random.default_rng(0)
    offsets = rng.uniform(-SPREAD, SPREAD, (POSES, 12))
    offsets[0] = 0.0
    offsets[1] = np.tile([0.0, -SPREAD, SPREAD], 4)  # feet far forward and up, as in a long step
    offsets[2] = np.tile([0.0, -SPREAD, 0.0], 4)
    found = []
    for offset in offsets:
        qpos = home_qpos()
        qpos[:3], qpos[7:] = 0.0, qpos[7:] + offset
        positions, rotations = shape.place(qpos)
        frames = [shape.names.index(body.body) for body in shape.bodies]
        parts = [
            (body.vertices @ rotations[k].T + positions[k], body.faces)
            for body, k in zip(shape.bodies, frames, strict=True)
            if body.body != "trunk"
        ]
        found.append(join_meshes(*parts))
    return found


def find_legs(camera, bodies) -> np.ndarray:
    """(poses, height, width): the pixels that show a leg."""
    n = len(bodies)
    depth = DepthCamera(bodies, camera).render(np.arange(n), np.zeros((n, 3)), np.repeat(np.eye(3)[None], n, 0))
    return (depth < camera.far).numpy()


def test_no_leg_is_in_view_ahead(bodies):
    assert not find_legs(NAVIGATION_CAMERA, bodies).any()


def test_of_the_legs_the_camera_below_sees_a_foot_at_its_lower_edge(bodies):
    legs = find_legs(LOCOMOTION_CAMERA, bodies)
    assert not legs[0].any()  # the default pose
    assert not legs[:, : 2 * LOCOMOTION_CAMERA.height // 3].any() and legs.mean() < 0.002


def test_the_test_would_notice(bodies):
    """A camera that looks straight down sees the fore legs."""
    down = replace(LOCOMOTION_CAMERA, pitch_down=1.5)
    assert (DepthCamera(bodies[:1], down).render([0], np.zeros((1, 3)), np.eye(3)[None]) < down.far).any()
