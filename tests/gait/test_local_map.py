"""A height map in the robot's heading frame reads nearly as the map of the world."""

from __future__ import annotations

import numpy as np
import torch

from vinl.gait.ground_view import FieldView, build_ground_map
from vinl.gait.local_map import POINTS, LocalMapView
from vinl.world.boxes import Boxes
from vinl.world.grid import BLOCK, GridFrame, flat_field, raise_boxes


def test_distances_and_heights_agree_with_those_of_the_world() -> None:
    frame, n = GridFrame(-4.0, -4.0, 0.05, (161, 161)), 4
    boxes = Boxes(np.array([[0.52, 0.1, 0.3, 0.2, 0.6, 0.0, 0.1], [-0.4, -0.2, 0.3, 0.2, 0.3, 0.0, 0.2]]))
    field = flat_field(frame)
    raise_boxes(field, boxes, BLOCK)
    ground, rng = build_ground_map(field.heights, frame, boxes), np.random.default_rng(0)
    yaw, qpos = rng.uniform(-0.5, 0.5, n), np.zeros((n, 7))
    qpos[:, 0], qpos[:, 2] = rng.uniform(-0.2, 0.3, n), 0.4
    qpos[:, 3], qpos[:, 6] = np.cos(yaw / 2), np.sin(yaw / 2)
    world = FieldView(np, ground, frame, qpos)
    heights = world.height(np.broadcast_to(POINTS, (n, *POINTS.shape))) + 0.4
    local = LocalMapView(np, heights, np.full(n, -0.4))
    points = rng.uniform([-0.5, -0.4, -0.4], [1.1, 0.4, -0.1], (n, 500, 3))
    true, read = world.clearance(points), local.clearance(points)
    near = (true > -0.02) & (true < 0.12)
    assert near.sum() > 300
    assert np.abs(read - true)[near].mean() < 0.01  # cells of 5 cm, turned against the world's
    np.testing.assert_array_less(np.abs(local.crest(points[..., :2]) - world.crest(points[..., :2])).mean(), 0.01)
    in_torch = LocalMapView(torch, torch.from_numpy(heights), torch.full((n,), -0.4, dtype=torch.float64))
    np.testing.assert_allclose(in_torch.clearance(torch.from_numpy(points)).numpy(), read, atol=1e-12)
    np.testing.assert_allclose(
        in_torch.height(torch.from_numpy(points[..., :2])).numpy(), local.height(points[..., :2])
    )


def test_a_wall_is_kept_off_and_no_ground_to_step_over() -> None:
    heights = np.where(POINTS[:, 1] > 0.24, 0.4, 0.0)[None]
    view = LocalMapView(np, heights, np.full(1, -0.4))
    beside = np.array([[[0.5, 0.2], [0.5, 0.3]]])
    np.testing.assert_allclose(view.crest(beside), -0.4)
    np.testing.assert_allclose(view.height(beside), -0.4)
    foot = np.concatenate([beside, np.full((1, 2, 1), -0.38)], -1)
    np.testing.assert_allclose(view.clearance(foot), [[0.025, -0.075]], atol=1e-6)
    high = LocalMapView(np, np.minimum(heights, 0.2), np.full(1, -0.4))
    np.testing.assert_allclose(high.crest(beside), -0.2)  # a block is stepped over


def test_a_nan_point_reads_something_and_stops_nothing() -> None:
    rows = np.random.default_rng(1).uniform(0.0, 0.2, (2, len(POINTS))).astype(np.float32)
    view = LocalMapView(torch, torch.from_numpy(rows), torch.zeros(2))
    points = torch.full((2, 3, 3), torch.nan)
    points[:, 0] = torch.tensor([0.3, 0.1, 0.0])
    assert torch.isfinite(view.clearance(points)[:, 0]).all()
    assert view.height(points[..., :2]).shape == (2, 3)
