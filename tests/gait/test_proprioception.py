"""Legs as an odometer: what a foot that rolls on the ground tells of the trunk."""

import mujoco
import numpy as np

from vinl.gait.proprioception import ROLLING_RADIUS, feet_in_trunk, velocities_by_feet
from vinl.robot.aliengo import FOOT_GEOMS, home_qpos
from vinl.robot.model import robot_spec
from vinl.robot.rotation import rotate_inverse


def test_a_foot_that_rolls_tells_how_fast_the_trunk_moves() -> None:
    rng, model = np.random.default_rng(6), robot_spec("spheres").compile()
    data, place = mujoco.MjData(model), np.zeros((3, model.nv))
    for k in range(40):
        foot = data.geom(FOOT_GEOMS[k % 4])
        data.qpos[:] = home_qpos(yaw=rng.uniform(-3, 3))
        data.qpos[3:7] += rng.uniform(-0.1, 0.1, 4)
        data.qpos[3:7] /= np.linalg.norm(data.qpos[3:7])
        data.qpos[7:] += rng.uniform(-0.4, 0.4, 12)
        data.qvel[:] = np.concatenate([np.zeros(3), rng.uniform(-0.5, 0.5, 3), rng.uniform(-1.0, 1.0, 12)])
        mujoco.mj_forward(model, data)
        below = foot.xpos - [0.0, 0.0, ROLLING_RADIUS]
        mujoco.mj_jac(model, data, place, None, below, model.geom(FOOT_GEOMS[k % 4]).bodyid[0])
        data.qvel[:3] -= place @ data.qvel  # the point that the foot rolls about is at rest
        turned, speeds = data.qpos[None, 3:7], data.qvel[None]
        gravity = rotate_inverse(np, turned, np.array([[0.0, 0.0, -1.0]]))
        joints = data.qpos[None, 7:]
        told = velocities_by_feet(np, feet_in_trunk(np, joints), joints, speeds[:, 6:], gravity, speeds[:, 3:6])
        trunk = rotate_inverse(np, turned, speeds[:, :3])
        np.testing.assert_allclose(told[0, k % 4], trunk[0], atol=0.01)  # joints are taken back by a control step
        assert np.abs(trunk).max() > 0.02
