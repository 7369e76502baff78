import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from vinl.robot.rotation import matrix_of, rotate_inverse, yaw_of

ROTATIONS = Rotation.random(100, random_state=0)
QUATERNIONS = ROTATIONS.as_quat(scalar_first=True)


def test_matrix():
    assert np.allclose(matrix_of(np, QUATERNIONS), ROTATIONS.as_matrix())
    assert np.allclose(matrix_of(np, QUATERNIONS.reshape(10, 10, 4)).reshape(-1, 3, 3), ROTATIONS.as_matrix())


def test_rotate_inverse():
    vectors = np.random.default_rng(1).normal(size=(100, 3))
    assert np.allclose(rotate_inverse(np, QUATERNIONS, vectors), ROTATIONS.inv().apply(vectors))


def test_yaw():
    assert np.allclose(yaw_of(np, QUATERNIONS), ROTATIONS.as_euler("ZYX")[:, 0])
    assert yaw_of(np, np.array([np.cos(0.6), 0, 0, np.sin(0.6)])) == pytest.approx(1.2)


def test_jax_gives_the_same():
    jnp = pytest.importorskip("jax.numpy")
    q = QUATERNIONS.astype(np.float32)
    v = np.random.default_rng(1).normal(size=(100, 3)).astype(np.float32)
    assert np.allclose(matrix_of(np, q), matrix_of(jnp, q), atol=1e-6)
    assert np.allclose(rotate_inverse(np, q, v), rotate_inverse(jnp, q, v), atol=1e-5)
    assert np.allclose(yaw_of(np, q), yaw_of(jnp, q), atol=1e-5)
