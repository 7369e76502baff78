"""A robot in its home from above, beside what it sees: for ``render`` and for looking at episodes."""

from __future__ import annotations

import math

import numpy as np
from jaxtyping import Float, UInt8
from PIL import Image, ImageDraw

from vinl.nav.home_store import HomeRecord
from vinl.nav.robot_config import RobotConfig
from vinl.world.boxes import Blocks, Boxes

HEIGHT = 360
"""Of the picture [pixels]."""

_MARGIN = 0.4
_PAPER, _WALL, _LOW, _BLOCK = "#f6f1e7", "#2f3437", "#d3c1a5", "#c8a24a"
_PATH, _ROBOT, _GOAL = "#1f5fa8", "#2a7f62", "#c8553d"
_TALL = 2.0
_LINTEL = 0.6


def draw_robot(
    home: HomeRecord,
    path: Float[np.ndarray, "k 2"],
    yaw: float,
    goal: Float[np.ndarray, " 2"],
    depth: Float[np.ndarray, "height width"] | None,
    robot: RobotConfig,
) -> UInt8[np.ndarray, "rows columns 3"]:
    """Draw a home from above and the depth image beside it.

    Args:
        home: what stands where.
        path: places so far [m], the last one is the robot's.
        yaw: heading [rad].
        goal: [m].
        depth: in [0, 1], near is dark; None or empty: the plan alone.
        robot: its footprint.
    """
    solid = home.solid[home.solid[:, 5] < _LINTEL].astype(np.float64)
    corners = Boxes(solid).corners()
    low, high = corners.min((0, 1)) - _MARGIN, corners.max((0, 1)) + _MARGIN
    scale = (HEIGHT - 1) / float((high - low)[1])
    image = Image.new("RGB", (max(math.ceil(float((high - low)[0]) * scale), 1), HEIGHT), _PAPER)
    pen = ImageDraw.Draw(image)

    def pixels(points: np.ndarray) -> list[tuple[float, float]]:
        at = (np.atleast_2d(points) - low) * scale
        return [(float(x), HEIGHT - 1 - float(y)) for x, y in at]

    for k in np.argsort(solid[:, 6]):  # the highest on top
        pen.polygon(pixels(corners[k]), fill=_WALL if solid[k, 6] > _TALL else _LOW)
    if len(home.blocks):
        for corner in Blocks(home.blocks.astype(np.float64)).boxes().corners():
            pen.polygon(pixels(corner), fill=_BLOCK)
    ((x, y),) = pixels(goal)
    radius = 0.325 * scale
    pen.ellipse((x - radius, y - radius, x + radius, y + radius), outline=_GOAL, width=3)
    if len(path) > 1:
        pen.line(pixels(path), fill=_PATH, width=2)
    body = Boxes(np.array([[*path[-1], yaw, robot.length, robot.width, 0.0, 1.0]])).corners()[0]
    pen.polygon(pixels(body), fill=_ROBOT)
    nose = path[-1] + robot.length / 2 * np.array([math.cos(yaw), math.sin(yaw)])
    pen.line(pixels(np.stack([path[-1], nose])), fill=_PAPER, width=2)
    picture = np.asarray(image)
    if depth is None or depth.size == 0:
        return picture.copy()
    width = round(HEIGHT / 2 * depth.shape[1] / depth.shape[0])
    grey = Image.fromarray((np.sqrt(depth) * 255).astype(np.uint8)).resize((width, HEIGHT // 2))
    side = np.zeros((HEIGHT, width, 3), np.uint8)
    side[: HEIGHT // 2] = np.asarray(grey)[:, :, None]
    return np.concatenate([picture, side], axis=1)
