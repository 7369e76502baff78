import gzip
import json

import numpy as np
import pytest

from vinl.config.errors import InputError
from vinl.world.free_space import FreeSpace
from vinl.world.readers import load_floorplan


def point(x, z, y=0.0):
    return {"x": x, "y": y, "z": z}


def wall(name, a, b):
    return {"id": name, "polygon": [point(*a), point(*b), point(*a, 2.8), point(*b, 2.8)]}


def draw_house(door_x=(0.5, 1.5), exterior=False, keep_wall0=True):
    """Two rooms, 4 m x 3 m each; the wall between them is there twice, once for each room, running opposite ways."""
    walls = [
        wall("wall|2|a", (0, 0), (4, 0)),
        wall("wall|2|b", (0, 3), (0, 0)),
        wall("wall|2|c", (4, 0), (4, 3)),
        wall("wall|2|d", (4, 3), (0, 3)),
        wall("wall|3|a", (4, 0), (8, 0)),
        wall("wall|3|b", (8, 0), (8, 3)),
        wall("wall|3|c", (8, 3), (4, 3)),
        wall("wall|3|d", (4, 3), (4, 0)),
        wall("wall|exterior|a", (8, 3), (0, 3)),
    ]
    if not keep_wall0:
        walls = [w for w in walls if w["id"] != "wall|2|c"]
    hole = {"holePolygon": [point(door_x[0], 0), point(door_x[1], 0, 2.1)]}
    doors = [{"id": "d", "room0": "room|2", "room1": "room|3", "wall0": "wall|2|c", "wall1": "wall|3|d", **hole}]
    doors.append(
        {"id": "e", "room0": "room|2", "room1": "room|2", "wall0": "wall|2|d", "wall1": "wall|exterior|a", **hole}
    )
    rooms = [
        {"roomType": "Kitchen", "floorPolygon": [point(0, 0), point(4, 0), point(4, 3), point(0, 3)]},
        {"roomType": "Bedroom", "floorPolygon": [point(4, 0), point(8, 0), point(8, 3), point(4, 3)]},
    ]
    objects = [
        {"assetId": "Bed_1", "position": point(7.0, 2.0, 0.3), "rotation": point(0, 0, 90)},
        {"assetId": "Odd", "position": point(1.0, 2.2, 0.2), "rotation": point(0, 0, 0)},
        {"assetId": "Odd", "position": point(2.0, 1.0, 1.5), "rotation": point(0, 0, 0)},
    ]
    return {"rooms": rooms, "walls": walls, "doors": doors if not exterior else doors[1:], "objects": objects}


def save(path, content):
    text = content if isinstance(content, str) else json.dumps(content)
    path.write_bytes(gzip.compress(text.encode()) if path.suffix == ".gz" else text.encode())
    return path


def free_at(plan, x, y):
    return bool(plan.free[tuple(plan.frame.cell(np.array([x, y])))])


@pytest.mark.parametrize("keep_wall0", [True, False])
def test_inner_doors_open_both_twins_and_outer_doors_stay_shut(tmp_path, keep_wall0):
    plan = load_floorplan(save(tmp_path / "house.json", draw_house(keep_wall0=keep_wall0)))
    assert plan.name == "house" and [label.name for label in plan.labels] == ["Kitchen", "Bedroom"]
    assert free_at(plan, 4.0, 1.0) and not free_at(plan, 4.0, 2.0)  # wall0 starts at (4, 0): the door is at y 0.5 - 1.5
    assert not free_at(plan, 3.0, 3.0)
    assert FreeSpace(plan).regions.max() == 1
    lintels = plan.walls.rows[plan.walls.rows[:, 5] > 0]
    assert len(lintels) == 1 and np.allclose(lintels[0, 5:], [2.1, 2.8])


def test_without_a_door_there_are_two_regions(tmp_path):
    assert FreeSpace(load_floorplan(save(tmp_path / "h.json", draw_house(exterior=True)))).regions.max() == 2


def test_furniture_has_its_size_turned_or_a_cube(tmp_path):
    path = save(tmp_path / "house.json", draw_house())
    assert np.allclose(load_floorplan(path).furniture.rows[:, 3:5], 0.4)
    save(tmp_path / "asset_bbox.json", {"Bed_1": {"bbox": [1.0, 0.6, 2.0]}})
    plan = load_floorplan(path)
    low = plan.furniture.corners()[0].min(0)
    assert np.allclose(low, [6.0, 1.5])  # 1 m x 2 m turned by a quarter
    assert not free_at(plan, 6.1, 2.0) and free_at(plan, 7.0, 1.3)
    assert free_at(plan, 2.0, 1.0) and not free_at(plan, 1.0, 2.2)  # a picture on the wall, a thing on the floor


def test_turning_is_clockwise_from_above(tmp_path):
    house = draw_house()
    house["objects"] = [{"assetId": "Bed_1", "position": point(2.0, 1.5, 0.3), "rotation": point(0, 0, 30)}]
    save(tmp_path / "asset_bbox.json", {"Bed_1": {"bbox": [2.0, 0.6, 0.4]}})
    plan = load_floorplan(save(tmp_path / "house.json", house))
    ahead = np.array([2.0 + 0.8 * np.cos(np.pi / 6), 1.5 - 0.8 * np.sin(np.pi / 6)])
    assert plan.furniture.contain(ahead[None]).all()


@pytest.mark.parametrize("ending", ["jsonl", "jsonl.gz"])
def test_one_of_several_is_chosen_by_number(tmp_path, ending):
    small = draw_house(exterior=True)
    path = save(tmp_path / f"houses.{ending}", "\n".join(map(json.dumps, [draw_house(), small])) + "\n\n")
    assert FreeSpace(load_floorplan(f"{path}:0")).regions.max() == 1
    plan = load_floorplan(f"{path}:1")
    assert plan.name == "houses:1" and plan.source == f"{path}:1" and FreeSpace(plan).regions.max() == 2
    for index, match in (("2", "0 to 1"), ("-1", "no plan"), ("x", "number of a plan")):
        with pytest.raises(InputError, match=match):
            load_floorplan(f"{path}:{index}")


def test_bad_json_is_explained(tmp_path):
    whole = gzip.compress(json.dumps(draw_house()).encode())
    lacking = draw_house()
    del lacking["walls"][0]["polygon"]
    words = draw_house()
    words["objects"][0]["position"]["x"] = "left"
    endless = draw_house()
    endless["rooms"][0]["floorPolygon"][0]["x"] = 1e9
    cases = {
        "broken.json": ("{", "broken JSON"),
        "broken.jsonl": ("{\n", "broken JSON"),
        "number.json": ("3", "not a floor plan"),
        "empty.jsonl": ("", "empty"),
        "list.json": ("[]", "empty"),
        "other.json": ("{}", "not a floor plan"),
        "schema.json": ('{"schema": "vinl/floorplan/9"}', "unknown schema"),
        "own.json": ('{"schema": "vinl/floorplan/1"}', "lacks an entry"),
        "lacking.json": (lacking, "lacks an entry"),
        "words.json": (words, "broken number"),
        "endless.json": (endless, "check its scale"),
        "bare.json": ({"rooms": [], "walls": []}, "no rooms"),
    }
    for name, (content, match) in cases.items():
        with pytest.raises(InputError, match=match) as caught:
            load_floorplan(save(tmp_path / name, content))
        assert name in str(caught.value) and "\n" not in str(caught.value)
    for name, data, match in (
        ("cut.jsonl.gz", whole[: len(whole) // 2], "cut off or damaged"),
        ("plain.json.gz", b"{}", "not a gzip file"),
        ("bytes.json", b"\xff\xfe\x00\x81", "not a text file"),
    ):
        (tmp_path / name).write_bytes(data)
        with pytest.raises(InputError, match=match):
            load_floorplan(tmp_path / name)
    save(tmp_path / "asset_bbox.json", "[")
    with pytest.raises(InputError, match=r"asset_bbox\.json"):
        load_floorplan(save(tmp_path / "house.json", draw_house()))
