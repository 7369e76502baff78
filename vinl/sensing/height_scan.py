"""The height scan: what the ground's height is under points around the robot, for numpy and jax.numpy alike."""

from __future__ import annotations

from typing import Any

from vinl.robot.observation import SCAN_POINTS
from vinl.robot.rotation import yaw_of
from vinl.world.grid import GridFrame


def scan_ground(xp: Any, heights: Any, frame: GridFrame, qpos: Any) -> Any:
    """Height of the ground [m] under every scan point (n, 187), read from the nearest cell of a grid, (rows, columns)
    or flat.

    The points, in the order of ``SCAN_POINTS``, are turned by the trunk's heading (not by its roll and pitch) and moved
    to the trunk, whose position [m] and unit quaternion w x y z begin ``qpos``. A point outside the grid reads the
    grid's nearest edge cell. The frame is static, so under ``jax.jit`` (``xp`` is ``numpy`` or ``jax.numpy``) the whole
    scan is one gather from a flat array. Raises ``ValueError`` if the heights do not have as many cells as the frame.
    """
    rows, columns = frame.shape
    flat = heights.reshape(-1)
    if flat.shape[0] != rows * columns:
        raise ValueError(f"heights hold {flat.shape[0]} cells, the frame has {rows} x {columns}")
    yaw = yaw_of(xp, qpos[:, 3:7])[:, None]
    c, s = xp.cos(yaw), xp.sin(yaw)
    points = xp.asarray(SCAN_POINTS / frame.resolution, dtype=qpos.dtype)
    j = (qpos[:, 0:1] - frame.x0) / frame.resolution + c * points[:, 0] - s * points[:, 1]
    i = (qpos[:, 1:2] - frame.y0) / frame.resolution + s * points[:, 0] + c * points[:, 1]
    # Held to the grid while still floating point: a robot that was thrown far away must not overflow the integer.
    row = xp.clip(xp.rint(i), 0, rows - 1).astype(xp.int32)
    column = xp.clip(xp.rint(j), 0, columns - 1).astype(xp.int32)
    return xp.take(flat, row * columns + column, mode="clip")
