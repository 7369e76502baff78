"""Tiles of hurdles: nobody leaves the middle without stepping over each ring."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import ndimage

from vinl.world.grid import BLOCK
from vinl.world.terrain import TILE, TerrainConfig, build_terrain, draw_bars, draw_hurdles


@given(st.integers(0, 10**6))
def test_rings_are_closed_and_keep_to_the_tile(seed: int) -> None:
    blocks = draw_hurdles(np.random.default_rng(seed), TILE, 0.8, (0.1, 0.2))
    assert len(blocks) >= 8 and len(blocks) % 4 == 0  # two rings at least
    assert blocks.rows[:, 5].min() >= 0.1 and blocks.rows[:, 5].max() <= 0.2
    boxes = blocks.boxes()
    for ring in boxes.corners().reshape(-1, 4, 4, 2):
        assert np.abs(ring).max() <= TILE / 2 + 1e-9
    axis = np.arange(-TILE / 2 + 0.025, TILE / 2, 0.05)
    points = np.stack(np.meshgrid(axis, axis, indexing="ij"), -1)
    free = np.logical_not(boxes.contain(points.reshape(-1, 2)).any(0)).reshape(points.shape[:2])
    assert free[np.abs(points).max(-1) < 0.8].all()
    count = ndimage.label(free, output=np.zeros(free.shape, int))
    assert count == len(blocks) // 4 + 1  # the middle, what lies between two rings, and outside


@given(st.integers(0, 10**6), st.floats(0.05, 0.25))
def test_bars_reach_from_side_to_side(seed: int, depth: float) -> None:
    blocks = draw_bars(np.random.default_rng(seed), TILE, 0.8, (0.1, 0.2), depth)
    rows, boxes = blocks.rows, blocks.boxes()
    assert len(blocks) >= 4 and np.ptp(rows[:, 2] % np.pi) < 1e-9 and np.allclose(rows[:, 4], depth)
    assert np.abs(boxes.corners()).max() <= TILE / 2 + 1e-9 and rows[:, 3].min() > 0.8 * TILE
    assert boxes.distances(np.zeros((1, 2))).min() >= 0.8 * np.sqrt(2) - 1e-9
    # straight across they lie on both sides of the start
    away = rows[:, :2] @ [np.cos(rows[0, 2] + np.pi / 2), np.sin(rows[0, 2] + np.pi / 2)]
    assert away.min() < -0.8 < 0.8 < away.max()


def test_a_terrain_of_hurdles_grows_with_the_level() -> None:
    config = TerrainConfig(
        slope=0, rough_slope=0, stairs_up=0, stairs_down=0, discrete=0, hurdles=1.0, levels=3, columns=2,
        first_height=(0.02, 0.04),
    )  # fmt: skip
    terrain = build_terrain(config)
    tops = [terrain.ground.heights[:, slice(*_columns(terrain, k))].max() for k in range(3)]
    assert tops[0] == 0
    assert 0.02 < tops[1] < 0.13 and tops[1] < tops[2] <= 0.2
    assert np.array_equal(terrain.ground.labels == BLOCK, terrain.ground.heights > 0)
    assert terrain.starts[..., 2] == pytest.approx(0)


def _columns(terrain, level: int) -> tuple[int, int]:
    """Columns of the grid that a level's tiles lie on."""
    _, column = terrain.ground.frame.cell(terrain.starts[level, 0, :2])
    half = round(TILE / 2 / terrain.ground.frame.resolution)
    return column - half + 1, column + half - 1
