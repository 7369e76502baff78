import numpy as np
import pytest

from vinl.robot.aliengo import DEFAULT_POSE, home_qpos
from vinl.robot.observation import (
    PROPRIOCEPTION_SIZE,
    SCAN_POINTS,
    SCAN_SIZE,
    TABLE,
    observe,
)


def random_state(n: int, seed: int = 0, dtype: type = np.float64) -> list[np.ndarray]:
    rng = np.random.default_rng(seed)
    qpos = rng.normal(size=(n, 19))
    qpos[:, 3:7] /= np.linalg.norm(qpos[:, 3:7], axis=1, keepdims=True)
    shapes = ((n, 18), (n, 3), (n, 12), (n, 187))
    return [array.astype(dtype) for array in (qpos, *(rng.normal(size=shape) for shape in shapes))]


def test_layout():
    assert [(term.name, term.size) for term in TABLE] == [
        ("base_linear_velocity", 3),
        ("base_angular_velocity", 3),
        ("projected_gravity", 3),
        ("command", 3),
        ("joint_position", 12),
        ("joint_velocity", 12),
        ("previous_action", 12),
        ("height_scan", 187),
    ]
    assert (PROPRIOCEPTION_SIZE, SCAN_SIZE, TABLE.size) == (48, 187, 235)
    assert TABLE.scale.shape == TABLE.noise.shape == (235,)


def test_scales_are_those_of_the_published_config():
    expected = (
        [2.0] * 3 + [0.25] * 3 + [1.0] * 3 + [2.0, 2.0, 0.25] + [1.0] * 12 + [0.05] * 12 + [1.0] * 12 + [5.0] * 187
    )
    assert np.allclose(TABLE.scale, expected)
    noise = [0.2] * 3 + [0.05] * 3 + [0.05] * 3 + [0] * 3 + [0.01] * 12 + [0.075] * 12 + [0] * 12 + [0.5] * 187
    assert np.allclose(TABLE.noise, noise)


def test_scan_points():
    assert SCAN_POINTS.shape == (187, 2)
    assert np.allclose(SCAN_POINTS[0], [-0.8, -0.5]) and np.allclose(SCAN_POINTS[-1], [0.8, 0.5])
    assert np.allclose(SCAN_POINTS[1], [-0.8, -0.4]) and np.allclose(SCAN_POINTS[93], 0.0)


def test_rows_are_found_by_their_name():
    assert TABLE.place("command") == slice(9, 12) and TABLE.place("height_scan") == slice(48, 235)
    with pytest.raises(KeyError, match="foothold"):
        TABLE.place("foothold")


def test_the_ground_must_be_that_of_the_scan():
    *state, _ = random_state(2)
    with pytest.raises(ValueError, match="187 points, got 188"):
        observe(np, *state, np.zeros((2, 188)))


def test_a_robot_that_stands_still_observes_almost_nothing():
    obs = observe(np, home_qpos()[None], np.zeros((1, 18)), np.zeros((1, 3)), np.zeros((1, 12)), np.zeros((1, 187)))
    assert obs.shape == (1, 235)
    assert np.allclose(obs[0, 6:9], [0, 0, -1])
    assert np.allclose(np.delete(obs[0, :48], [6, 7, 8]), 0, atol=1e-9)
    assert np.allclose(obs[0, 48:], 5.0 * (0.38 - 0.5))


def test_every_number_is_where_the_table_says():
    qpos, qvel, command, action, ground = random_state(1)
    qpos[0, 3:7] = [np.cos(np.pi / 4), 0, 0, np.sin(np.pi / 4)]  # heading along y
    qpos[0, 2], ground[:] = 0.6, 0.2
    qvel[0, :3] = [0.0, 1.0, 0.0]
    obs = observe(np, qpos, qvel, command, action, ground)[0]
    assert np.allclose(obs[:3], [2.0, 0.0, 0.0], atol=1e-6)
    assert np.allclose(obs[3:6], 0.25 * qvel[0, 3:6])
    assert np.allclose(obs[9:12], command[0] * [2.0, 2.0, 0.25])
    assert np.allclose(obs[12:24], qpos[0, 7:] - DEFAULT_POSE)
    assert np.allclose(obs[24:36], 0.05 * qvel[0, 6:])
    assert np.allclose(obs[36:48], action[0])
    assert np.allclose(obs[48:], 5.0 * (0.6 - 0.5 - 0.2))


def test_the_scan_and_all_else_are_held():
    qpos, qvel, command, action, ground = random_state(2)
    ground[0], ground[1] = -50.0, 50.0
    qvel[0, 6] = 1e6
    obs = observe(np, qpos, qvel, command, action, ground)
    assert (obs[0, 48:] == 5.0).all() and (obs[1, 48:] == -5.0).all() and obs[0, 24] == 100.0


def test_numpy_and_jax_give_the_same_numbers():
    jax = pytest.importorskip("jax")
    state = random_state(64, dtype=np.float32)
    here = observe(np, *state)
    there = np.asarray(jax.jit(lambda *args: observe(jax.numpy, *args))(*state))
    assert here.dtype == there.dtype == np.float32
    assert np.allclose(here, there, atol=2e-5)


def test_description_is_plain_data():
    import json

    table = json.loads(json.dumps(TABLE.describe()))
    assert sum(row["size"] for row in table) == 235 and table[0]["unit"] == "m/s"
