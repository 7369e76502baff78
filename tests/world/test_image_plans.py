import numpy as np
import pytest
from PIL import Image

from vinl.config.errors import InputError
from vinl.world.free_space import FreeSpace
from vinl.world.readers import load_floorplan


def draw_home(shape=(100, 100), low=10, high=90):
    """Four rooms of a Gibson-like plan: walls one pixel thick, doors of eight pixels; true is wall."""
    walls = np.zeros(shape, bool)
    walls[[low, high], low : high + 1] = walls[low : high + 1, [low, high]] = True
    middle = (low + high) // 2
    walls[middle, low:high] = walls[low:high, middle] = True
    for a in (low + 15, high - 20):
        walls[middle, a : a + 8] = walls[a : a + 8, middle] = False
    return walls


def save_alpha(path, walls):
    pixels = np.zeros((*walls.shape, 4), np.uint8)
    pixels[..., 3] = np.where(walls, 255, 0)
    Image.fromarray(pixels).save(path)
    return path


def save_grey(path, walls):
    Image.fromarray(np.where(walls, 0, 255).astype(np.uint8)).save(path)
    return path


def inside_at(plan, x, y):
    return bool(plan.inside[tuple(plan.frame.cell(np.array([x, y])))])


def test_thin_alpha_walls_make_one_home(tmp_path):
    plan = load_floorplan(save_alpha(tmp_path / "gibson.png", draw_home()), resolution=0.12)
    assert plan.name == "gibson" and len(plan.walls) < 20 and not len(plan.furniture)
    assert plan.area_m2 == pytest.approx((79 * 0.12) ** 2, rel=0.05)
    space = FreeSpace(plan)
    assert space.regions.max() == 1
    assert not inside_at(plan, 0.5, 6.0) and inside_at(plan, 3.0, 3.0)


@pytest.mark.parametrize("ending", ["png", "pgm"])
def test_dark_is_wall_and_the_origin_is_lower_left(tmp_path, ending):
    walls = draw_home()
    walls[20:30, 15:25] = True  # upper left of the picture: large y
    plan = load_floorplan(save_grey(tmp_path / f"home.{ending}", walls), resolution=0.1)
    assert not plan.free[tuple(plan.frame.cell(np.array([2.0, 7.5])))]
    assert plan.free[tuple(plan.frame.cell(np.array([2.0, 2.5])))]
    assert np.allclose(plan.walls.corners().reshape(-1, 2).min(0), [1.0, 0.9])


def test_light_floor_and_dark_walls_on_a_transparent_ground(tmp_path):
    walls = draw_home()
    pixels = np.zeros((100, 100, 4), np.uint8)
    pixels[10:91, 10:91] = 255
    pixels[walls] = [20, 20, 20, 255]
    Image.fromarray(pixels).save(tmp_path / "home.png")
    plan = load_floorplan(tmp_path / "home.png", resolution=0.1)
    assert plan.area_m2 == pytest.approx(62, rel=0.06)


@pytest.mark.parametrize("gap", [4, 9, 13])
def test_the_outside_stays_outside_through_an_open_front_door(tmp_path, gap):
    walls = draw_home()
    walls[10, 20 : 20 + gap] = False
    walls[30 : 30 + gap // 2, 90] = False
    plan = load_floorplan(save_alpha(tmp_path / "open.png", walls), resolution=0.1)
    assert inside_at(plan, 3.0, 7.0) and inside_at(plan, 7.0, 3.0)
    assert not inside_at(plan, 2.5, 9.3) and not inside_at(plan, 5.0, 9.6) and not inside_at(plan, 9.5, 6.5)
    assert plan.area_m2 == pytest.approx(61, rel=0.08)


def test_dashed_outer_walls_hold(tmp_path):
    walls = draw_home()
    walls[10, 12:90:3] = walls[90, 11:90:4] = False
    plan = load_floorplan(save_alpha(tmp_path / "dashed.png", walls), resolution=0.1)
    assert plan.area_m2 == pytest.approx(61, rel=0.08)


def test_specks_are_dropped_on_request(tmp_path):
    walls = draw_home()
    walls[20:40:4, 20:40:4] = True
    path = save_alpha(tmp_path / "specks.png", walls)
    assert len(load_floorplan(path, 0.1).walls) - len(load_floorplan(path, 0.1, min_speck=3).walls) == 25


def test_a_closed_wall_may_touch_the_edge(tmp_path):
    walls = draw_home((81, 81), 0, 80)
    assert load_floorplan(save_grey(tmp_path / "edge.png", walls), 0.1).area_m2 == pytest.approx(61, rel=0.05)


def test_bad_pictures_are_explained(tmp_path):
    def fails(name, match, make=None, **kw):
        path = tmp_path / name
        if make is not None:
            make(path)
        with pytest.raises(InputError, match=match) as caught:
            load_floorplan(path, **kw)
        assert str(path.name) in str(caught.value) or "resolution" in str(caught.value)
        assert "\n" not in str(caught.value)

    home = draw_home()
    fails("missing.png", "no such file")
    fails("nothing.png", "not a picture", lambda p: p.write_bytes(b""))
    fails("text.png", "not a picture", lambda p: p.write_text("hello"))
    fails("blank.png", "empty", lambda p: save_grey(p, np.zeros((50, 50), bool)))
    fails("clear.png", "empty", lambda p: save_alpha(p, np.zeros((50, 50), bool)))
    fails("black.png", "whole picture is wall", lambda p: save_grey(p, np.ones((50, 50), bool)))
    fails("opaque.pgm", "whole picture is wall", lambda p: save_grey(p, np.ones((50, 50), bool)))
    fails("small.png", "too small for the robot", lambda p: save_alpha(p, home), resolution=0.005)
    fails("inverted.png", "invert the picture", lambda p: save_grey(p, ~home), resolution=0.1)
    fails("line.png", "no floor is enclosed", lambda p: save_alpha(p, np.eye(60, dtype=bool)), resolution=0.1)
    fails("a.png", "resolution", lambda p: save_alpha(p, home), resolution=-1.0)
    fails("b.png", "resolution", lambda p: save_alpha(p, home), resolution=500.0)
    fails("c.png", "resolution", lambda p: save_alpha(p, home), resolution=float("nan"))
    fails("d.gif", "unknown kind", lambda p: p.write_bytes(b"GIF89a"))
    fails("specks.png", "specks", lambda p: save_alpha(p, np.eye(3, 50, dtype=bool)), min_speck=99)

    def cut(path):
        save_grey(path, np.random.default_rng(0).random((90, 90)) < 0.5)
        path.write_bytes(path.read_bytes()[:600])

    fails("cut.png", "damaged|not a picture", cut)
    with pytest.raises(InputError, match="folder"):
        load_floorplan(tmp_path)
    with pytest.raises(InputError, match="leave :3 away"):
        load_floorplan(f"{save_alpha(tmp_path / 'ok.png', home)}:3")
