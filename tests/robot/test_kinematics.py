import mujoco
import numpy as np
import pytest

from vinl.robot.aliengo import FOOT_GEOMS, foot_positions
from vinl.robot.model import robot_spec


def random_poses(n: int) -> np.ndarray:
    rng = np.random.default_rng(0)
    qpos = rng.normal(size=(n, 19))
    qpos[:, 3:7] /= np.linalg.norm(qpos[:, 3:7], axis=1, keepdims=True)
    return qpos


def test_feet_are_where_the_simulator_has_them():
    qpos, model = random_poses(20), robot_spec("spheres").compile()
    data, feet = mujoco.MjData(model), foot_positions(np, random_poses(20))
    for k, pose in enumerate(qpos):
        data.qpos[:] = pose
        mujoco.mj_kinematics(model, data)
        np.testing.assert_allclose(feet[k], [data.geom(name).xpos for name in FOOT_GEOMS], atol=1e-9)


def test_numpy_and_jax_agree():
    jnp = pytest.importorskip("jax.numpy")
    qpos = random_poses(20).astype(np.float32)
    there = np.asarray(foot_positions(jnp, qpos))
    np.testing.assert_allclose(there, foot_positions(np, qpos), atol=1e-5)
    assert there.dtype == np.float32
