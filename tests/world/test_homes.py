import subprocess
import sys
from random import Random

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.ndimage import label

from vinl.config.errors import InputError
from vinl.config.loader import build_config, dump_config
from vinl.world.boxes import Boxes
from vinl.world.floorplan import BODY_HEIGHT
from vinl.world.free_space import FIT_RADIUS, FreeSpace
from vinl.world.homes import HomeConfig, generate_home
from vinl.world.homes.furnish import furnish
from vinl.world.homes.generate import draw_shell
from vinl.world.homes.walls import Shell
from vinl.world.raster import paint_boxes
from vinl.world.start_goal import sample_start_goals

SEEDS = st.integers(0, 100_000)


def draw(seed: int, config: HomeConfig | None = None) -> tuple[Random, Shell]:
    rng = Random(seed)
    return rng, draw_shell(rng, config or HomeConfig())


@settings(max_examples=20, deadline=None)
@given(SEEDS)
def test_every_room_is_reached(seed):
    plan = generate_home(seed)
    for radius in (0.22, FIT_RADIUS):
        space = FreeSpace(plan, radius=radius)
        main = space.regions == space.largest
        assert main.sum() >= 0.85 * space.traversable.sum(), "all but pockets behind furniture"
        for room in plan.labels:
            spots = plan.frame.xy(np.argwhere(main))
            assert np.linalg.norm(spots - [room.x, room.y], axis=1).min() < 2.0, f"{room.name} is shut off"
    assert len(sample_start_goals(plan, 1, np.random.default_rng(seed), min_distance=3.0)) == 1


@settings(max_examples=20, deadline=None)
@given(SEEDS)
def test_rooms_hold_together_by_doors_of_the_right_width(seed):
    config = HomeConfig()
    _, shell = draw(seed)
    assert config.area[0] <= sum(room.area for room in shell.rooms) <= config.area[1]
    assert config.inner_wall[0] <= shell.inner <= shell.outer <= config.outer_wall[1]
    joined = {0}
    for _ in shell.rooms:
        for edge in shell.edges:
            if edge.gaps and joined & set(edge.rooms):
                joined |= set(edge.rooms)
    assert joined == set(range(len(shell.rooms)))
    for edge in shell.edges:
        for low, high, top in edge.gaps:
            assert min(edge.rooms) >= 0, "no gap leads outside"
            assert edge.low < low < high < edge.high
            assert 0.75 - 1e-6 <= high - low <= 2.4 + 1e-6
            assert top >= config.door_height[0]


@settings(max_examples=20, deadline=None)
@given(SEEDS)
def test_furniture_stands_in_its_room_and_in_no_doorway(seed):
    rng, shell = draw(seed)
    for piece in furnish(rng, shell, HomeConfig(bare_share=0.0)):
        room = shell.rooms[piece.room]
        corners = Boxes(np.array(piece.rows)).corners().reshape(-1, 2)
        low, high = np.array([rect[:2] for rect in room.rects]), np.array([rect[2:] for rect in room.rects])
        held = ((corners[:, None] >= low) & (corners[:, None] <= high)).all(-1).any(1)
        assert held.all()
        for x0, y0, x1, y1 in shell.clear[piece.room]:
            middle = np.array([[(x0 + x1) / 2, (y0 + y1) / 2]])
            assert not Boxes(np.array(piece.rows)).contain(middle).any()


@pytest.mark.parametrize("seed", range(12))
def test_walls_are_closed(seed):
    plan = generate_home(seed)
    walls = paint_boxes(Boxes(plan.walls.rows[plan.walls.rows[:, 5] < BODY_HEIGHT]), plan.frame)
    regions, _ = label(~walls)
    assert not (plan.free & (regions == regions[0, 0])).any()


def test_same_seed_same_home_on_any_grid():
    fine, again, coarse = generate_home(5), generate_home(5), generate_home(5, resolution=0.1)
    assert np.array_equal(fine.boxes.rows, again.boxes.rows) and np.array_equal(fine.free, again.free)
    assert np.array_equal(fine.boxes.rows, coarse.boxes.rows)
    assert coarse.frame.resolution == 0.1 and abs(coarse.area_m2 - fine.area_m2) < 0.05 * fine.area_m2
    assert not np.array_equal(fine.walls.rows, generate_home(6).walls.rows)


def test_homes_are_of_many_kinds():
    plans = [generate_home(seed, resolution=0.1) for seed in range(50)]
    kinds = {room.name for plan in plans for room in plan.labels}
    assert {"living", "kitchen", "bedroom", "bath", "hall", "studio", "store"} <= kinds
    bare = [plan for plan in plans if not len(plan.furniture)]
    assert 0 < len(bare) < 12
    rows = np.concatenate([plan.furniture.rows for plan in plans])
    tops = rows[rows[:, 5] < BODY_HEIGHT][:, 6]
    assert tops.min() <= 0.3 and tops.max() <= 2.35 and (rows[:, 5] > 0.0).mean() > 0.1, "a camera sees under some"
    assert (np.abs(np.sin(2 * rows[:, 2])) > 1e-3).mean() > 0.02, "some stand askew"
    areas = [plan.area_m2 for plan in plans]
    assert min(areas) < 50 and max(areas) > 120


def test_config_rules():
    small = HomeConfig(area=(40.0, 60.0), door_width=(0.9, 0.9), furniture_density=(0.0, 0.0), passage_share=0.0)
    for seed in range(5):
        plan = generate_home(seed, small, resolution=0.1)
        assert not len(plan.furniture)
        gaps = [b - a for edge in draw(seed, small)[1].edges for a, b, _ in edge.gaps]
        assert np.allclose(gaps, 0.9, atol=2e-3)
    assert build_config(HomeConfig, dump_config(small)) == small


@pytest.mark.parametrize(
    "settings",
    [
        {"area": (60.0, 40.0)},
        {"door_width": (0.5, 1.0)},
        {"open_plan_share": 1.5},
        {"wall_height": (2.0, 3.0)},
        {"corridor_width": (1.0, 1.2), "outer_wall": (0.3, 0.5), "inner_wall": (0.1, 0.3)},
        {"area": (100.0, 101.0)},
        {"furniture_density": (0.0, float("nan"))},
    ],
)
def test_impossible_configs_are_explained(settings):
    with pytest.raises(InputError, match="homes"):
        HomeConfig(**settings)


def test_bad_seed_and_resolution():
    for options in ({"seed": -1}, {"seed": 0, "resolution": 0.5}):
        with pytest.raises(InputError, match="homes"):
            generate_home(**options)


def test_a_training_host_needs_no_geometry_libraries():
    block = "import sys; sys.modules.update(dict.fromkeys(['shapely', 'networkx', 'trimesh'], None))\n"
    code = "from vinl.world.homes import generate_home; import vinl.world.readers, vinl.world.clutter; generate_home(0)"
    subprocess.run([sys.executable, "-c", block + code], check=True)
