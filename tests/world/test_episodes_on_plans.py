"""Free space, starts and goals, clutter: on one small plan made here."""

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from vinl.config.errors import InputError
from vinl.world.boxes import Boxes
from vinl.world.clutter import CLUTTER, ClutterPreset, scatter_blocks
from vinl.world.floorplan import FloorPlan, assemble_floorplan
from vinl.world.free_space import FreeSpace
from vinl.world.grid import GridFrame
from vinl.world.start_goal import sample_start_goals


def build_plan(width=9.0, height=6.0, door=True, gap=1.2) -> FloorPlan:
    """Two rooms side by side, a table in the left one, a cupboard hung on the wall in the right one."""
    t = 0.1
    rows = [
        [width / 2, 0, 0, width + t, t, 0, 2.5],
        [width / 2, height, 0, width + t, t, 0, 2.5],
        [0, height / 2, 0, t, height, 0, 2.5],
        [width, height / 2, 0, t, height, 0, 2.5],
        [width / 2, height / 2 - (gap / 2 if door else 0), 0, t, height - (gap if door else 0), 0, 2.5],
    ]
    furniture = [[width / 4, height / 3, 0.4, 1.2, 0.8, 0, 0.75], [width * 0.8, height / 2, 0, 0.6, 0.4, 1.4, 2.0]]
    frame = GridFrame(-0.475, -0.475, 0.05, (int(height / 0.05) + 20, int(width / 0.05) + 20))
    x, y = frame.centres()
    inside = (x[None] > 0) & (x[None] < width) & (y[:, None] > 0) & (y[:, None] < height)
    return assemble_floorplan("test", "test", Boxes(np.array(rows)), Boxes(np.array(furniture)), inside, frame)


PLAN = build_plan()


def test_free_space_is_the_floor_less_the_footprint():
    space = FreeSpace(PLAN)
    assert not (PLAN.free & ~PLAN.inside).any() and not (space.traversable & ~PLAN.free).any()
    assert space.regions.max() == 1 and space.clearance[~PLAN.free].max() == 0
    assert PLAN.free[tuple(PLAN.frame.cell(np.array([7.2, 3.0])))]  # under the hung cupboard
    row, column = PLAN.frame.cell(np.array([2.25, 5.0]))
    assert space.clearance[row, column] == pytest.approx(0.95, abs=0.05)
    assert FreeSpace(build_plan(door=False)).regions.max() == 2


def test_a_robot_that_fits_nowhere_is_an_error():
    with pytest.raises(InputError, match="too small"):
        FreeSpace(PLAN, radius=5.0)
    with pytest.raises(InputError, match="too small"):
        build_plan(1.4, 1.3, door=False)


@pytest.mark.parametrize("door", [True, False])
def test_start_and_goal_share_a_region_and_keep_clear(door):
    plan = build_plan(9.0 if door else 7.0, 5.0, door)
    space = FreeSpace(plan)
    for pair in sample_start_goals(plan, 8, np.random.default_rng(1)):
        a, b = plan.frame.cell(pair.start), plan.frame.cell(pair.goal)
        assert space.regions[tuple(a)] == space.regions[tuple(b)] == space.largest
        assert space.clearance[tuple(a)] >= 0.5 and space.clearance[tuple(b)] >= 0.5
        assert pair.straight_m == pytest.approx(np.linalg.norm(pair.goal - pair.start))
        assert pair.geodesic_m >= pair.straight_m and -np.pi <= pair.yaw < np.pi
        assert pair.straight_m >= 5.0 or not door
        assert (pair.note == "") == door


def test_no_way_leads_through_a_gap_that_the_robot_would_get_stuck_in():
    plan = build_plan(14.0, 6.0, gap=0.5)
    for pair in sample_start_goals(plan, 8, np.random.default_rng(1)):
        assert (pair.start[0] < 7.0) == (pair.goal[0] < 7.0) and "left out" in pair.note
    far = sample_start_goals(plan, 8, np.random.default_rng(1), min_distance=10.0)  # no room is that long
    assert all(pair.straight_m >= 10.0 and "narrower" in pair.note for pair in far)


def test_a_small_plan_says_how_far_it_allows():
    for pair in sample_start_goals(build_plan(5.0, 2.5), 4, np.random.default_rng(0)):
        assert 1.0 < pair.straight_m < 5.0 and "at most" in pair.note


def test_a_plan_without_way_to_go_is_an_error():
    with pytest.raises(InputError, match="too small"):
        sample_start_goals(build_plan(3.2, 1.6, door=False), 1, np.random.default_rng(0))


def test_the_same_seed_gives_the_same_pairs():
    first, second = (sample_start_goals(PLAN, 3, np.random.default_rng(7)) for _ in range(2))
    assert all(
        (a.start == b.start).all() and (a.goal == b.goal).all() and a.yaw == b.yaw
        for a, b in zip(first, second, strict=True)
    )
    with pytest.raises(InputError):
        sample_start_goals(PLAN, -1, np.random.default_rng(0))


@settings(max_examples=6)
@given(st.integers(0, 10**6), st.sampled_from(["paper", "dense"]))
def test_blocks_keep_their_distances(seed, name):
    preset = CLUTTER[name]
    keep = np.array([[1.5, 4.5], [7.5, 1.5]])
    blocks = scatter_blocks(PLAN, preset, np.random.default_rng(seed), keep)
    centres = blocks.rows[:, :2]
    apart = np.linalg.norm(centres[:, None] - centres[None], axis=-1) + 99 * np.eye(len(blocks))
    assert apart.min() >= preset.spacing
    assert np.linalg.norm(centres[:, None] - keep[None], axis=-1).min() >= 1.5
    shapes = shapely.polygons(blocks.boxes().corners())
    solid = shapely.union_all(shapely.polygons(Boxes(PLAN.boxes.rows[PLAN.boxes.rows[:, 5] < 0.6]).corners()))
    assert not shapely.intersects(shapes, solid).any()
    cells = PLAN.frame.cell(centres)
    assert PLAN.free[cells[:, 0], cells[:, 1]].all()
    _, _, _, length, width, height = blocks.rows.T
    assert (length >= 0.2).all() and (length <= 0.5).all() and (width == 0.2).all()
    assert (height >= 0.1).all() and (height <= 0.2).all()


def test_density_is_reached_on_wide_floor():
    plan = build_plan(16.0, 12.0)
    for name, least in (("paper", 0.93), ("dense", 0.93)):
        preset = CLUTTER[name]
        blocks = scatter_blocks(plan, preset, np.random.default_rng(0), np.zeros((0, 2)))
        assert least * preset.density <= len(blocks) / plan.area_m2 <= preset.density + 0.01


def test_no_clutter_and_no_room_for_clutter():
    rng = np.random.default_rng(0)
    assert len(scatter_blocks(PLAN, CLUTTER["none"], rng, np.zeros((0, 2)))) == 0
    everywhere = ClutterPreset(density=1.0, clear=50.0)
    assert len(scatter_blocks(PLAN, everywhere, rng, np.array([[1.0, 1.0]]))) == 0
