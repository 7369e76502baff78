import shutil

import numpy as np
import pytest

from vinl.config.errors import InputError
from vinl.config.paths import assets_dir
from vinl.world.boxes import Boxes
from vinl.world.drawing import draw_floorplan, save_floorplan
from vinl.world.free_space import FreeSpace, distance_field
from vinl.world.raster import paint_boxes
from vinl.world.readers import load_floorplan, load_floorplans, open_floorplans, shipped_floorplans
from vinl.world.start_goal import sample_start_goals

NAMES = ["family_home", "garden_bungalow", "harbour_flat", "mill_loft", "old_town"]


def test_there_are_five():
    assert shipped_floorplans() == NAMES
    assert [plan.name for plan in load_floorplans(["old_town", "mill_loft"])] == ["old_town", "mill_loft"]


def test_what_is_given_twice_is_there_once(tmp_path, monkeypatch):
    file = assets_dir() / "floorplans" / "mill_loft.json"
    (tmp_path / "link.json").symlink_to(file)
    copy = str(shutil.copy(file, tmp_path / "copy.json"))
    monkeypatch.chdir(tmp_path)
    same = ["mill_loft", str(file), f"{file}:0", "link.json", str(tmp_path / "link.json")]
    assert [plan.name for plan in load_floorplans(same)] == ["mill_loft"]
    plan, other = load_floorplans(["mill_loft", copy])  # another file, whatever it holds
    opened = open_floorplans([plan, *same, plan, file, other])
    assert opened[0] is plan and opened[2] is other and len(opened) == 3


@pytest.mark.parametrize("name", NAMES)
def test_a_shipped_plan_is_a_home(name):
    plan = load_floorplan(name)
    floor = plan.inside & ~paint_boxes(Boxes(plan.walls.rows[plan.walls.rows[:, 5] == 0]), plan.frame)
    assert 60 <= plan.area_m2 <= floor.sum() * plan.frame.resolution**2 <= 150
    assert len(plan.furniture) >= 40 and len(plan.labels) >= 2
    wide = FreeSpace(plan, radius=0.38)
    assert (wide.regions == wide.largest).sum() >= 0.97 * wide.traversable.sum(), "every way is 0.76 m wide"
    for label in plan.labels:
        near = np.linalg.norm(plan.frame.xy(np.argwhere(wide.regions == wide.largest)) - [label.x, label.y], axis=1)
        assert near.min() < 1.2, f"{label.name} is shut off"
    pairs = sample_start_goals(plan, 6, np.random.default_rng(0))
    assert all(pair.straight_m >= 5.0 and not pair.note for pair in pairs)
    assert all(np.isfinite(pair.geodesic_m) for pair in pairs)


@pytest.mark.parametrize("name", NAMES)
def test_no_episode_needs_a_squeeze(name):
    plan = load_floorplan(name)
    thin, wide = FreeSpace(plan), FreeSpace(plan, radius=0.35)
    spots = (thin.regions == thin.largest) & (thin.clearance >= 0.5)
    reached = spots & (wide.regions == wide.largest)
    assert reached.sum() >= 0.99 * spots.sum()
    # nor does a gap of less than 0.7 m make a way much shorter
    for pair in sample_start_goals(plan, 3, np.random.default_rng(3)):
        goal = pair.goal
        thin_way, wide_way = (distance_field(space.traversable, plan.frame, goal)[reached] for space in (thin, wide))
        far = thin_way > 3.0
        assert (wide_way[far] <= 1.25 * thin_way[far]).all()


def test_plans_are_drawn(tmp_path):
    plan = load_floorplan("mill_loft")
    pairs = sample_start_goals(plan, 1, np.random.default_rng(0))
    out = save_floorplan(plan, tmp_path / "deep" / "loft.png", dpi=40, start_goals=pairs, paths=[np.zeros((2, 2))])
    assert out.stat().st_size > 1000
    assert "free floor" in draw_floorplan(plan).axes[0].get_title()
    assert plan._repr_png_().startswith(b"\x89PNG")  # what a notebook shows
    with pytest.raises(InputError, match=r"\.png"):
        save_floorplan(plan, tmp_path / "loft.txt")
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="cannot be written"):
        save_floorplan(plan, tmp_path / "file" / "loft.png")
