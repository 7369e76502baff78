import numpy as np
import pytest

from vinl.robot.aliengo import home_qpos
from vinl.robot.observation import SCAN_POINTS
from vinl.sensing.height_scan import scan_ground
from vinl.world.grid import GridFrame

FRAME = GridFrame(-4.0, -3.0, 0.05, (121, 161))


def poses(n: int, seed: int = 0) -> np.ndarray:
    rng = np.random.default_rng(seed)
    rows = [home_qpos(*rng.uniform(-3, 3, 2), yaw=rng.uniform(-np.pi, np.pi)) for _ in range(n)]
    return np.array(rows)


def test_reads_a_known_field():
    x, y = np.meshgrid(*FRAME.centres())
    plane = (0.3 * x - 0.2 * y).astype(np.float32)
    qpos = poses(20)
    qpos[:, :2] *= 0.5
    yaw = 2 * np.arctan2(qpos[:, 6], qpos[:, 3])
    c, s = np.cos(yaw)[:, None], np.sin(yaw)[:, None]
    px = qpos[:, :1] + c * SCAN_POINTS[:, 0] - s * SCAN_POINTS[:, 1]
    py = qpos[:, 1:2] + s * SCAN_POINTS[:, 0] + c * SCAN_POINTS[:, 1]
    scan = scan_ground(np, plane.ravel(), FRAME, qpos)
    assert scan.shape == (20, 187)
    # Half a cell off in x and y at most.
    assert np.abs(scan - (0.3 * px - 0.2 * py)).max() <= 0.025 * 0.5 + 1e-6


def test_looks_ahead_and_to_the_left():
    heights = np.zeros(FRAME.shape, np.float32)
    i, j = FRAME.cell(np.array([0.8, 0.5]))
    heights[i, j] = 1.0
    scan = scan_ground(np, heights, FRAME, home_qpos()[None])
    assert scan.argmax() == 186
    scan = scan_ground(np, heights, FRAME, home_qpos(0.3, -0.3, yaw=np.pi / 2)[None])
    assert np.allclose(SCAN_POINTS[scan.argmax()], [0.8, -0.5])


def test_tilt_does_not_move_the_points():
    heights = np.random.default_rng(0).random(FRAME.shape)
    upright = home_qpos(0.512, 0.317)[None]
    tilted = upright.copy()
    tilted[0, 3:7] = [np.cos(0.2), 0.0, np.sin(0.2), 0.0]
    assert (scan_ground(np, heights, FRAME, upright) == scan_ground(np, heights, FRAME, tilted)).all()


def test_off_the_grid_reads_the_edge():
    heights = np.zeros(FRAME.shape, np.float32)
    heights[-1, -1] = 7.0
    far = np.array([home_qpos(1e7, 1e7), home_qpos(-1e12, -1e12)])
    scan = scan_ground(np, heights, FRAME, far)
    assert (scan[0] == 7.0).all() and (scan[1] == 0.0).all()


def test_heights_must_fit_the_frame():
    with pytest.raises(ValueError, match="121 x 161"):
        scan_ground(np, np.zeros(5), FRAME, poses(1))


def test_numpy_and_jax_give_the_same_numbers():
    jax = pytest.importorskip("jax")
    heights = np.random.default_rng(1).random(FRAME.shape).astype(np.float32)
    qpos = poses(200).astype(np.float32)
    here = scan_ground(np, heights.ravel(), FRAME, qpos)
    there = np.asarray(jax.jit(lambda h, q: scan_ground(jax.numpy, h, FRAME, q))(heights.ravel(), qpos))
    assert there.dtype == np.float32
    # The two round sines differently in the last bit: a point on the border of two cells may fall on either side.
    assert (here == there).mean() > 0.9995
