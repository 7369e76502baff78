"""Blocks in the kinematic environment: who stands above one, as exact geometry says, and what it costs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch
from shapely import affinity
from shapely.geometry import box

from vinl.nav.block_contact import BlockTable
from vinl.nav.config import ClutterConfig, RewardConfig
from vinl.nav.environment import NavEnvironment
from vinl.nav.home_store import HomeStore
from vinl.robot.aliengo import WIDTH
from vinl.world.readers import load_floorplan


def rectangle(x: float, y: float, yaw: float, length: float, width: float):
    return affinity.translate(
        affinity.rotate(box(-length / 2, -width / 2, length / 2, width / 2), yaw, (0, 0), use_radians=True), x, y
    )


def test_above_a_block_is_what_exact_geometry_says() -> None:
    rng = np.random.default_rng(0)
    table = BlockTable(3, 400, torch.device("cpu"))
    poses = np.column_stack([rng.uniform(-5, 5, (400, 2)), rng.uniform(-np.pi, np.pi, 400)])
    expected, close = [], []
    for slot, (x, y, yaw) in enumerate(poses):
        n = rng.integers(4)
        near = rng.uniform(-0.7, 0.7, (n, 2)) + np.array([x, y])
        blocks = np.column_stack(
            [near, rng.uniform(-np.pi, np.pi, n), rng.uniform(0.2, 0.5, n), np.full(n, 0.2), np.full(n, 0.15)]
        )
        table.rows(slot).copy_(torch.from_numpy(table.encode(blocks)))
        robot = rectangle(x, y, yaw, 0.65, WIDTH)
        shapes = [rectangle(*row[:5]) for row in blocks]
        expected.append(any(robot.intersects(shape) for shape in shapes))
        # a hair's breadth may fall to either side in single precision
        gaps = [
            abs(robot.buffer(d).intersects(shape) - robot.buffer(-d).intersects(shape))
            for shape in shapes
            for d in [1e-5]
        ]
        close.append(any(gaps))
    pose = torch.as_tensor(poses, dtype=torch.float32)
    found = table.find_above(torch.arange(400), pose[:, :2], pose[:, 2], 0.65).numpy()
    sure = ~np.array(close)
    assert sure.sum() > 390 and 50 < sum(expected) < 350
    np.testing.assert_array_equal(found[sure], np.array(expected)[sure])


def test_a_home_with_more_blocks_than_there_was_room_for() -> None:
    block = np.array([[0.0, 0.0, 0.3, 0.4, 0.2, 0.15]])
    table, pose = BlockTable(0, 2, torch.device("cpu")), torch.zeros(2, 3)
    assert not table.find_above(torch.arange(2), pose[:, :2], pose[:, 2], 0.65).any()
    for slot, rows in ((0, block), (1, np.concatenate([block + np.eye(6)[0] * 9, block]))):
        table.reserve(len(rows))
        table.rows(slot).copy_(torch.from_numpy(table.encode(rows)))
    table.rows(0).copy_(torch.from_numpy(table.encode(block + np.eye(6)[0] * 9)))
    assert table.most == 2
    assert table.find_above(torch.arange(2), pose[:, :2], pose[:, 2], 0.65).tolist() == [False, True]


def test_steps_above_blocks_cost_and_are_counted(config) -> None:
    config = replace(config, num_envs=64, camera=None, clutter=ClutterConfig(share=1.0, density=(1.0, 1.0)))
    homes = HomeStore.from_plans([load_floorplan("harbour_flat")], config)
    free, dear = (
        NavEnvironment(replace(config, reward=RewardConfig(block=block)), homes, seed=3) for block in (0.0, -0.5)
    )
    above = 0.0
    for step in range(20):
        action = torch.rand(64, 2, generator=torch.Generator().manual_seed(step)) * 2 - 1
        costs = free.step(action).reward - dear.step(action).reward
        assert (torch.isclose(costs, torch.tensor(0.5), atol=1e-6) | (costs.abs() < 1e-6)).all()
        above += float((costs > 0.25).sum())
    assert 0.1 < above / (20 * 64) < 0.9
    assert dear.read_measures()["above_blocks"] == pytest.approx(above / (20 * 64))
    assert "above_blocks" not in free.read_measures()
