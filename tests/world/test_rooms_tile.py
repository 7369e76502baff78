"""Tiles of rooms: a start that is free for every heading, doorways that a robot fits through, walls that get nearer."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import ndimage

from vinl.world.terrain import TILE, TerrainConfig, build_terrain, draw_rooms


@given(st.integers(0, 10**6), st.floats(0, 1))
def test_the_start_is_free_and_has_a_way_out(seed: int, difficulty: float) -> None:
    walls = draw_rooms(np.random.default_rng(seed), TILE, difficulty)
    angle = np.linspace(0, 2 * np.pi, 16, endpoint=False)
    around = np.stack([np.cos(angle), np.sin(angle)], 1)
    # 0.3 m off the middle, with half a robot (0.325 m) ahead
    assert walls.distances(0.3 * around).min() > 0.25
    axis = np.arange(-TILE / 2 + 0.025, TILE / 2, 0.05)
    points = np.stack(np.meshgrid(axis, axis, indexing="ij"), -1).reshape(-1, 2)
    free = (walls.distances(points).min(0) > 0.2).reshape(len(axis), -1)  # a gap of 0.4 m: the legs fit through
    regions = np.zeros(free.shape, int)
    ndimage.label(free, output=regions)
    middle = len(axis) // 2
    here = regions == regions[middle, middle]
    assert np.abs(points.reshape(*free.shape, 2)[here]).max() > 1.4  # beyond the room in the middle


def test_walls_get_nearer() -> None:
    def room(difficulty: float) -> float:
        axis = np.linspace(-3, 3, 61)
        points = np.stack(np.meshgrid(axis, axis), -1).reshape(-1, 2)
        drawn = [draw_rooms(np.random.default_rng(k), TILE, difficulty) for k in range(20)]
        return float(np.mean([walls.distances(points).min(0).mean() for walls in drawn]))

    assert room(0.9) < 0.85 * room(0.0)


def test_a_terrain_of_rooms_has_walls_and_blocks() -> None:
    config = TerrainConfig(
        slope=0, rough_slope=0, stairs_up=0, stairs_down=0, discrete=0, rooms=0.5, blocks=0.5, levels=3, columns=2,
        wall_blocks=0.5,
    )  # fmt: skip
    terrain = build_terrain(config)
    assert terrain.kinds == ["blocks", "rooms"]
    near = [terrain.tall.distances(start[None, :2]).min() for start in terrain.starts.reshape(-1, 3)]
    assert max(near[1::2]) < 1.1 < min(near[0::2])
    assert terrain.starts[:, 1, 2] == pytest.approx(0)
    assert len(terrain.blocks) > 10
