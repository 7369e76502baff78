"""The height scan: what the ground's height is under points around the robot, for numpy and jax.numpy alike."""

from __future__ import annotations

from typing import Any

from vinl.robot.kinematics import foot_positions
from vinl.robot.observation import FOOT_POINTS, STANDARD_SCAN, HeightScan
from vinl.robot.rotation import yaw_of
from vinl.world.grid import GridFrame


def scan_ground(xp: Any, heights: Any, frame: GridFrame, qpos: Any, scan: HeightScan = STANDARD_SCAN) -> Any:
    """Height of the ground under every scan point, read from the nearest cell of a grid.

    The points of the scan are turned by the trunk's heading (not by its roll and pitch) and moved to the trunk, those
    about the feet to each foot.
    A point outside the grid reads the grid's nearest edge cell. The frame is static, so under ``jax.jit`` the whole
    scan is one gather from a flat array.

    Args:
        xp: ``numpy`` or ``jax.numpy``.
        heights: (rows * columns,) or (rows, columns), height of the ground [m], rows along y.
        frame: where the cells lie.
        qpos: (n, >= 7), trunk position [m] and unit quaternion w x y z; joint angles [rad], (n, 19) in all, where the
            scan has points about the feet. What follows is ignored.
        scan: where to read.

    Returns:
        (n, scan.size) heights [m], in the order of ``scan.points``, then of ``FOOT_POINTS`` for each leg.

    Raises:
        ValueError: if the heights do not have as many cells as the frame.
    """
    rows, columns = frame.shape
    flat = heights.reshape(-1)
    if flat.shape[0] != rows * columns:
        raise ValueError(f"heights hold {flat.shape[0]} cells, the frame has {rows} x {columns}")
    yaw = yaw_of(xp, qpos[:, 3:7])[:, None]
    c, s = xp.cos(yaw), xp.sin(yaw)

    def cells(about_x: Any, about_y: Any, offsets: Any) -> tuple[Any, Any]:
        points = xp.asarray(offsets / frame.resolution, dtype=qpos.dtype)
        j = (about_x - frame.x0) / frame.resolution + c * points[:, 0] - s * points[:, 1]
        return j, (about_y - frame.y0) / frame.resolution + s * points[:, 0] + c * points[:, 1]

    j, i = cells(qpos[:, 0:1], qpos[:, 1:2], scan.points)
    if scan.feet:
        feet = foot_positions(xp, qpos)
        near = [cells(feet[:, k, 0:1], feet[:, k, 1:2], FOOT_POINTS) for k in range(feet.shape[1])]
        j, i = (xp.concatenate(parts, -1) for parts in zip((j, i), *near, strict=True))
    # Held to the grid while still floating point: a robot that was thrown far away must not overflow the integer.
    row = xp.clip(xp.rint(i), 0, rows - 1).astype(xp.int32)
    column = xp.clip(xp.rint(j), 0, columns - 1).astype(xp.int32)
    return xp.take(flat, row * columns + column, mode="clip")
