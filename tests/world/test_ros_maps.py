import numpy as np
import pytest
from PIL import Image

from vinl.config.errors import InputError
from vinl.world.readers import load_floorplan

HEAD = (
    "image: map.png\nresolution: 0.1\norigin: [-4.0, -2.0, 0.0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"
)


def draw_map():
    """Two rooms, 6 m x 4 m, the unknown around them; a shelf with unknown inside."""
    pixels = np.full((60, 80), 205, np.uint8)
    pixels[10:50, 10:70] = 254
    pixels[[10, 49], 10:70] = pixels[10:50, [10, 69]] = 0
    pixels[10:50, 40] = 0
    pixels[25:35, 40] = 254
    pixels[30:36, 15:23] = 0
    pixels[31:35, 16:22] = 205
    return pixels


def save_map(folder, pixels=None, text=HEAD, name="map"):
    Image.fromarray(draw_map() if pixels is None else pixels).save(folder / "map.png")
    (folder / f"{name}.yaml").write_text(text)
    return folder / f"{name}.yaml"


def free_at(plan, x, y):
    return bool(plan.free[tuple(plan.frame.cell(np.array([x, y])))])


def test_occupied_is_wall_and_unknown_is_not_free(tmp_path):
    plan = load_floorplan(save_map(tmp_path))
    assert plan.name == tmp_path.name
    assert free_at(plan, -1.0, 2.0) and not free_at(plan, -2.0, 0.8) and not free_at(plan, -3.5, 1.0)
    assert plan.area_m2 == pytest.approx(38 * 58 * 0.01 - 0.48 - 0.28, rel=0.03)
    assert plan.walls.rows[:, 6].max() == 2.5


def test_grey_205_is_unknown_whatever_the_threshold(tmp_path):
    area = load_floorplan(save_map(tmp_path)).area_m2
    assert load_floorplan(save_map(tmp_path, text=HEAD.replace("0.196", "0.25"))).area_m2 == pytest.approx(area)


def test_yaw_of_the_origin_turns_the_map(tmp_path):
    straight = load_floorplan(save_map(tmp_path))
    turned = load_floorplan(save_map(tmp_path, text=HEAD.replace("0.0]", "0.5]"), name="turned"))
    assert turned.area_m2 == pytest.approx(straight.area_m2, rel=0.02)
    assert len(turned.walls) == len(straight.walls)
    c, s = np.cos(0.5), np.sin(0.5)
    x, y = -1.0 + 4.0, 2.0 + 2.0
    assert free_at(turned, -4 + c * x - s * y, -2 + s * x + c * y)


def test_negate_and_raw_mode(tmp_path):
    area = load_floorplan(save_map(tmp_path)).area_m2
    negated = save_map(tmp_path, 255 - draw_map(), HEAD.replace("negate: 0", "negate: 1"), "negated")
    assert load_floorplan(negated).area_m2 == pytest.approx(area)
    raw = draw_map()
    raw = np.select([raw == 0, raw == 254], [100, 0], 255).astype(np.uint8)
    assert load_floorplan(save_map(tmp_path, raw, HEAD + "mode: raw\n", "raw")).area_m2 == pytest.approx(area)


def test_a_broken_wall_and_rays_through_the_door_stay_outside(tmp_path):
    pixels = draw_map()
    pixels[10, 20:30] = 254
    pixels[0:10, 18:32] = 254  # what the laser saw through the open door
    pixels[12:48:5, 69] = 254
    plan = load_floorplan(save_map(tmp_path, pixels))
    assert not free_at(plan, -1.5, 3.5) and free_at(plan, -1.5, 2.5)


def test_floor_that_borders_on_the_unknown_is_kept(tmp_path):
    pixels = np.full((100, 100), 205, np.uint8)
    pixels[20:80, 20:80] = 254
    pixels[20, 20:80] = 0
    assert load_floorplan(save_map(tmp_path, pixels)).area_m2 == pytest.approx(59 * 60 * 0.01, rel=0.03)


@pytest.mark.parametrize(
    "text, match",
    [
        ("image: [", "line 1, is not valid YAML"),
        ("just words", "must hold keys and values"),
        ("", "names no picture"),
        ("resolution: 0.05", "names no picture"),
        (HEAD.replace("map.png", "gone.png"), "does not exist"),
        (HEAD.replace("resolution: 0.1", ""), "'resolution:' is missing"),
        (HEAD.replace("0.1\n", "0\n"), "not sensible"),
        (HEAD.replace("0.1\n", "fine\n"), "not a number"),
        (HEAD.replace("0.1\n", ".nan\n"), "not a number"),
        (HEAD.replace("[-4.0, -2.0, 0.0]", "here"), "origin"),
        (HEAD.replace("0.65", "0.1"), "thresholds"),
        (HEAD.replace("negate: 0", "negate: 1"), "too small|no floor|no occupied|no free|cover"),
        (HEAD.replace("0.1\n", "0.004\n"), "too small for the robot"),
    ],
)
def test_bad_maps_are_explained(tmp_path, text, match):
    path = save_map(tmp_path, text=text)
    with pytest.raises(InputError, match=match) as caught:
        load_floorplan(path)
    assert "\n" not in str(caught.value) and str(tmp_path) in str(caught.value)


def test_maps_without_walls_or_floor_are_explained(tmp_path):
    for value, match in ((254, "no occupied"), (0, "no free"), (205, "no occupied")):
        with pytest.raises(InputError, match=match):
            load_floorplan(save_map(tmp_path, np.full((50, 50), value, np.uint8)))
