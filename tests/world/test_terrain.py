"""Training grounds: tiles as steep, high and dense as their level says, labels where boxes stand."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vinl.config.errors import InputError
from vinl.world.boxes import Boxes
from vinl.world.grid import BLOCK, GROUND, WALL, GridFrame, HeightField, flat_field, raise_boxes
from vinl.world.terrain import (
    CELLS,
    RESOLUTION,
    TILE,
    TerrainConfig,
    build_terrain,
    discrete_tile,
    slope_tile,
    stairs_tile,
)

BLOCKS = TerrainConfig(
    slope=0, rough_slope=0, stairs_up=0, stairs_down=0, discrete=0, blocks=1, levels=4, columns=2, seed=3
)


def test_slope_rises_by_its_grade():
    tile = slope_tile(0.5, up=True)
    rise = np.abs(np.diff(tile[CELLS // 2])) / RESOLUTION
    assert rise.max() == pytest.approx(0.4 * 0.5)
    assert tile[CELLS // 2, CELLS // 2] == tile.max()
    assert np.array_equal(slope_tile(0.5, up=False), -tile)


@given(st.floats(0, 0.9))
def test_stairs_have_nine_equal_steps(difficulty):
    row = stairs_tile(difficulty, up=True)[CELLS // 2]
    steps = np.abs(np.diff(row))
    assert np.allclose(steps[steps > 1e-9], 0.05 + 0.18 * difficulty)
    assert (steps > 1e-9).sum() == 2 * 9
    assert row[CELLS // 2] == row.max() == pytest.approx(9 * (0.05 + 0.18 * difficulty))


def test_discrete_tile_is_level_where_robots_start():
    tile = discrete_tile(0.9, np.random.default_rng(0))
    middle = slice(CELLS // 2 - 25, CELLS // 2 + 25)
    assert not tile[middle, middle].any()
    assert np.abs(tile).max() == pytest.approx(0.05 + 0.2 * 0.9)


def test_blocks_grow_denser_with_the_level_and_leave_the_start_free():
    terrain = build_terrain(BLOCKS)
    starts, rows = terrain.starts, terrain.blocks.rows
    counts = []
    for k in range(BLOCKS.levels):
        inside = np.abs(rows[None, :, :2] - starts[k, :, None, :2]).max(-1) <= TILE / 2
        counts.append(inside.sum())
        near = np.abs(rows[None, :, :2] - starts[k, :, None, :2]).max(-1)
        assert near.min() >= BLOCKS.start_clear
    assert counts[0] == 0
    assert counts == sorted(counts)
    assert counts[-1] == pytest.approx(BLOCKS.columns * BLOCKS.block_density * TILE**2, rel=0.1)
    assert rows[:, 3].min() >= 0.2 and rows[:, 3].max() <= 0.5
    assert rows[:, 5].min() >= 0.1 and rows[:, 5].max() <= 0.2
    assert not starts[..., 2].any()


def test_labels_tell_blocks_from_walls_from_ground():
    terrain = build_terrain(BLOCKS)
    ground = terrain.ground
    for row in terrain.blocks.rows[:20]:
        i, j = ground.frame.cell(row[:2])
        assert ground.labels[i, j] in (BLOCK, WALL)
        assert ground.heights[i, j] >= row[5] - 1e-6
    assert (ground.heights[ground.labels == GROUND] == 0).all()
    assert (ground.heights[ground.labels == WALL] == 1).all()


def test_walls_leave_the_start_free():
    shares = {"slope": 0, "rough_slope": 0, "stairs_up": 0, "stairs_down": 0, "discrete": 0}
    terrain = build_terrain(TerrainConfig(**shares, walls=1, levels=10, columns=2))
    assert len(terrain.tall) > 40
    assert not terrain.starts[..., 2].any()


def test_columns_follow_the_shares():
    kinds = TerrainConfig(stairs_up=0.25, walls=0.1).column_kinds()
    expected = {"slope": 2, "rough_slope": 2, "stairs_up": 5, "stairs_down": 5, "discrete": 4, "walls": 2}
    assert {kind: kinds.count(kind) for kind in kinds} == expected


def test_same_seed_same_ground():
    one, two = build_terrain(BLOCKS), build_terrain(BLOCKS)
    assert np.array_equal(one.ground.heights, two.ground.heights)


@given(
    st.floats(-1, 1), st.floats(-1, 1), st.floats(0, 3.1), st.floats(0.2, 1.0), st.floats(0.2, 0.5), st.floats(0.1, 1)
)
def test_raised_cells_are_those_inside_the_footprint(x, y, yaw, length, width, top):
    field = flat_field(GridFrame(-2.0, -2.0, 0.05, (81, 81)))
    box = Boxes(np.array([[x, y, yaw, length, width, 0.0, top]]))
    raise_boxes(field, box, BLOCK)
    xs, ys = field.frame.centres()
    grid = np.stack(np.meshgrid(xs, ys), -1).reshape(-1, 2)
    assert np.array_equal(field.labels.reshape(-1) == BLOCK, box.contain(grid)[0])
    assert set(np.unique(field.heights)) <= {np.float32(0), np.float32(top)}


def test_the_higher_of_two_boxes_wins():
    field = flat_field(GridFrame(-1.0, -1.0, 0.1, (21, 21)))
    low, high = np.array([[0, 0, 0, 1, 1, 0, 0.2]]), np.array([[0, 0, 0, 0.4, 0.4, 0, 1.0]])
    raise_boxes(field, Boxes(high), WALL)
    raise_boxes(field, Boxes(low), BLOCK)
    assert field.heights[10, 10] == 1.0 and field.labels[10, 10] == WALL
    assert field.heights[10, 14] == np.float32(0.2) and field.labels[10, 14] == BLOCK


@pytest.mark.parametrize(
    "wrong", [{"slope": 0.5}, {"levels": 0}, {"block_height": (0.2, 0.1)}, {"tall_density": -1.0}, {"slope": -0.1}]
)
def test_impossible_terrain_is_refused(wrong):
    with pytest.raises(InputError, match="terrain"):
        TerrainConfig(**wrong)


def test_heights_must_be_finite():
    frame = GridFrame(0, 0, 0.1, (2, 2))
    with pytest.raises(InputError, match="finite"):
        HeightField(np.full((2, 2), np.nan, np.float32), np.zeros((2, 2), np.uint8), frame)


def test_depth_grows_before_height():
    config = replace(BLOCKS, first_height=(0.03, 0.06), depth=(0.05, 0.25), levels=5)
    terrain = build_terrain(config)
    rows = terrain.blocks.rows
    for k in range(1, config.levels):
        here = rows[np.abs(rows[:, None, :2] - terrain.starts[k, None, :, :2]).max(-1).min(1) <= TILE / 2]
        low, high = config.heights_at(k)
        assert low <= here[:, 5].min() and here[:, 5].max() <= high
        assert np.allclose(here[:, 4], min(config.depth_at(k), 0.2))
    assert [config.depth_at(k) for k in range(5)] == pytest.approx([0.05, 0.15, 0.25, 0.25, 0.25])
    assert config.heights_at(2) == (0.03, 0.06) < config.heights_at(3) < config.heights_at(4)
    assert config.heights_at(0) == (0.03, 0.06) and config.heights_at(config.levels - 1) == pytest.approx((0.1, 0.2))
    with pytest.raises(InputError, match="terrain"):
        replace(BLOCKS, first_height=(0.2, 0.1))
    with pytest.raises(InputError, match="depth"):
        replace(BLOCKS, depth=(0.2, 0.1))
    with pytest.raises(InputError, match="ghost"):
        replace(BLOCKS, ghost=2.0)
