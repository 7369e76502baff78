"""Blocks are crossed at half a metre a second at least, unless a wall is ahead; nobody runs into a wall."""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np
import pytest
import torch

from vinl.gait.command import CROSSING_SPEED, GRAZING_SPEED, adapt_command
from vinl.gait.config import GaitConfig
from vinl.gait.ground_view import FieldView, build_ground_map
from vinl.gait.local_map import POINTS, LocalMapView
from vinl.gait.state import feet_in_heading_frame
from vinl.robot.aliengo import FOOT_RADIUS, home_qpos
from vinl.world.boxes import Boxes
from vinl.world.grid import BLOCK, GridFrame, flat_field, raise_boxes

CONFIG = GaitConfig()
FRAME = GridFrame(-4.0, -4.0, 0.05, (161, 161))
SHOE = ([0.5, 0.0, 0.4, 0.15, 0.15, 0.0, 0.1],)
BAR, LATER, PASSED = (([x, 0.0, 0.0, 0.2, 1.0, 0.0, 0.1],) for x in (0.5, 1.2, -0.8))
BESIDE = ([0.5, 0.5, 0.0, 0.2, 0.2, 0.0, 0.1],)
WALL, WALLS_BESIDE = ([0.9, 0.0, 0.0, 0.1, 2.0, 0.0, 2.5],), ([0.5, 0.35, 0.0, 2.0, 0.1, 0.0, 2.5],)


def walked_by(boxes, command, xp=np, convert=np.asarray, config=CONFIG) -> np.ndarray:
    """The command of a robot in the middle of the world, by its map."""
    field, boxes = flat_field(FRAME), Boxes(np.array(boxes).reshape(-1, 7))
    raise_boxes(field, Boxes(boxes.rows[boxes.rows[:, 6] < 0.5]), BLOCK)
    ground = build_ground_map(field.heights, FRAME, boxes)
    qpos = home_qpos(0.0, 0.0, 0.38, 0.0)[None].astype(np.float32)
    view = FieldView(xp, type(ground)(*map(convert, ground)), FRAME, convert(qpos))
    feet = feet_in_heading_frame(np, qpos)
    asked = np.array([command], np.float32)
    return np.asarray(adapt_command(xp, config, view, convert(asked), convert(feet)))[0]


@pytest.mark.parametrize("kind", ["numpy", "jax"])
@pytest.mark.parametrize(
    ("boxes", "forward", "walked"),
    [
        (BAR, 0.3, CROSSING_SPEED),
        ((*BAR, *WALLS_BESIDE), 0.3, CROSSING_SPEED),
        (BAR, 0.05, 0.05),  # it is to turn on the spot
        (BAR, -0.3, -0.3),
        (BAR, 0.7, 0.7),
        ((*BAR, *WALL), 0.3, 0.3),
        ((), 0.3, 0.3),
        (LATER, 0.3, 0.3),
        (PASSED, 0.3, 0.3),
        (BESIDE, 0.3, 0.3),
        (SHOE, 0.3, 0.3),
        (WALLS_BESIDE, 0.3, 0.3),
    ],
)
def test_slow_commands_are_raised_over_blocks(boxes, forward, walked, kind):
    xp, convert = {"numpy": (np, np.asarray), "jax": (jnp, jnp.asarray)}[kind]
    np.testing.assert_allclose(walked_by(boxes, (forward, 0.1, -0.4), xp, convert), (walked, 0.1, -0.4), atol=1e-6)


BEFORE, GRAZED = ([0.45, 0.0, 0.0, 0.1, 2.0, 0.0, 2.5],), ([0.6, 0.32, 0.0, 0.4, 0.4, 0.0, 0.7],)


@pytest.mark.parametrize(
    ("boxes", "forward", "walked"),
    [
        (BEFORE, 0.8, GRAZING_SPEED),
        (GRAZED, 0.8, GRAZING_SPEED),  # a cabinet 0.12 m beside the middle of the way
        (([0.1, 0.0, 0.0, 0.2, 1.0, 0.0, 0.1], *BEFORE), 0.3, GRAZING_SPEED),
        (BEFORE, 0.1, 0.1),
        (BEFORE, -0.5, -0.5),  # away from it
        (WALL, 0.8, 0.8),  # half a metre on
        (WALLS_BESIDE, 0.8, 0.8),
        (([0.45, 0.0, 0.0, 0.1, 2.0, 0.0, 0.2],), 0.8, 0.8),  # to be stepped over
    ],
)
def test_a_wall_before_the_nose_slows_down(boxes, forward, walked):
    np.testing.assert_allclose(walked_by(boxes, (forward, 0.1, -0.4)), (walked, 0.1, -0.4), atol=1e-6)


def test_without_a_map_commands_stay():
    command = (0.3, 0.0, 0.2)
    np.testing.assert_allclose(walked_by(BAR, command, config=GaitConfig(map=False)), command)
    feet = feet_in_heading_frame(np, home_qpos(0.0, 0.0, 0.38, 0.0)[None])
    np.testing.assert_allclose(adapt_command(np, GaitConfig(), None, np.array([command]), feet), [command])


@pytest.mark.parametrize(
    ("height", "walked"), [(0.03, CROSSING_SPEED), (0.2, CROSSING_SPEED), (0.02, 0.3), (0.5, GRAZING_SPEED)]
)
def test_a_map_from_images_tells_blocks_from_floor_and_walls(height, walked):
    feet = feet_in_heading_frame(np, home_qpos(0.0, 0.0, 0.38, 0.0)[None])
    heights = np.where((POINTS[:, 0] > 0.36) & (POINTS[:, 0] < 0.62), height, 0.0)[None]
    asked, floor = np.array([[0.3, 0.0, 0.0]]), np.full(1, feet[..., 2].min() - FOOT_RADIUS)
    for xp, convert in ((np, np.asarray), (torch, torch.as_tensor)):
        view = LocalMapView(xp, convert(heights), convert(floor))
        command = adapt_command(xp, CONFIG, view, convert(asked), convert(feet))
        assert float(command[0, 0]) == pytest.approx(walked)
