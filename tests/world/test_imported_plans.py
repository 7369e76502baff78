import json

import numpy as np
import pytest
import trimesh

from vinl.config.errors import InputError
from vinl.world.boxes import Boxes
from vinl.world.free_space import FreeSpace
from vinl.world.homes import generate_home
from vinl.world.mesh import box_mesh, floorplan_mesh, join_meshes
from vinl.world.readers import load_floorplan, load_floorplans
from vinl.world.readers.houseexpo import find_crossing
from vinl.world.readers.own import write_floorplan


def free_at(plan, x, y):
    return bool(plan.free[tuple(plan.frame.cell(np.array([x, y])))])


def save(path, content):
    path.write_text(json.dumps(content))
    return path


# ---- our own boxes


def test_written_plans_are_read_again_cell_for_cell(tmp_path):
    for plan in (generate_home(3), load_floorplan("old_town"), generate_home(4, resolution=0.1)):
        again = load_floorplan(write_floorplan(plan, tmp_path / "deep" / "plan.json"))
        assert again.name == plan.name and again.frame == plan.frame and again.labels == plan.labels
        assert np.array_equal(again.free, plan.free) and np.array_equal(again.inside, plan.inside)
        for ours, theirs in (
            (again.walls, plan.walls),
            (again.furniture, plan.furniture),
            (again.windows, plan.windows),
        ):
            assert np.array_equal(ours.rows, theirs.rows)
    with pytest.raises(InputError, match=r"\.json"):
        write_floorplan(generate_home(3), tmp_path / "plan.txt")
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="cannot be written"):
        write_floorplan(generate_home(3), tmp_path / "file" / "plan.json")


def test_broken_boxes_are_explained(tmp_path):
    path = write_floorplan(generate_home(3), tmp_path / "plan.json")
    whole = json.loads(path.read_text())
    wrong = {
        "7 numbers": {"walls": [[1, 2, 3]]},
        "resolution": {"grid": {**whole["grid"], "resolution": 0}},
        "cells": {"grid": {**whole["grid"], "rows": 10**9}},
        "lacks an entry": {"grid": {}},
    }
    for match, change in wrong.items():
        with pytest.raises(InputError, match=match):
            load_floorplan(save(path, {**whole, **change}))


# ---- vectors


def draw_vectors(**changes):
    """Two rooms, 4 m x 3 m each, at 0.01 m a pixel; a door between them, a window, a storey of its own beside."""
    walls = [
        [0, 0, 400, 0],
        [400, 0, 800, 0],
        [800, 0, 800, 300],
        [0, 300, 800, 300],
        [0, 0, 0, 300],
        [400, 0, 400, 300],
    ]
    walls += [[900, 0, 1100, 0], [1100, 0, 1100, 200], [900, 200, 1100, 200], [900, 0, 900, 200]]
    plan = {
        "walls": walls,
        "doors": [[400, 50, 400, 150], [100, 300, 200, 300]],
        "icons": [[20, 20, 80, 80, "toilet"], [500, 100, 700, 200, "entrance"], [920, 20, 980, 80, "toilet"]],
        "rooms": [[100, 140, 140, 160, "bedroom"], [940, 90, 960, 110, "attic"], [0, 0, 5, 5, "point"]],
        "m_per_px_est": 0.01,
    }
    return {**plan, **changes}


def test_vectors(tmp_path):
    path = tmp_path / "plans.jsonl"
    path.write_text(json.dumps(draw_vectors()) + "\n" + json.dumps(draw_vectors(doors=[])) + "\n")
    plan, shut = load_floorplans([f"{path}:0", f"{path}:1"])
    assert [label.name for label in plan.labels] == ["bedroom"], "one storey: the larger"
    assert len(plan.furniture) == 1 and plan.furniture.rows[0, 6] == 0.8
    assert 21 < plan.area_m2 < 24
    assert free_at(plan, 4.0, -1.0) and not free_at(plan, 4.0, -2.0), "y in pixels goes down"
    assert not free_at(plan, 1.5, -3.0), "a door to the outside is a window"
    assert FreeSpace(plan).regions.max() == 1 and FreeSpace(shut).regions.max() == 2
    assert load_floorplan(f"{path}:0", resolution=0.02).area_m2 > 3.5 * plan.area_m2


def test_vectors_with_a_gap_in_the_outer_wall(tmp_path):
    gap = draw_vectors(
        walls=[[0, 0, 800, 0], [800, 0, 800, 300], [0, 300, 600, 300], [700, 300, 800, 300], [0, 0, 0, 300]]
    )
    assert 21 < load_floorplan(save(tmp_path / "gap.json", gap)).area_m2 < 25


@pytest.mark.parametrize(
    ("changes", "match"),
    [
        ({"m_per_px_est": None}, "--resolution"),
        ({"walls": [[0, 0, 400, 0], [0, 0, 0, 300]]}, "enclose no floor"),
        ({"walls": [[0, 0, "x", 0]]}, "broken number"),
        ({"walls": [[0, 0, float("inf"), 0]]}, "not a number"),
        ({"m_per_px_est": 0.001}, "too small"),
        (
            {
                "walls": [[0, 0, 90, 0], [90, 0, 90, 90], [0, 90, 90, 90], [0, 0, 0, 90]],
                "m_per_px_est": 0.013,
                "icons": [],
            },
            "without a path",
        ),
    ],
)
def test_bad_vectors_are_explained(tmp_path, changes, match):
    with pytest.raises(InputError, match=match):
        load_floorplan(save(tmp_path / "plan.json", draw_vectors(**changes)))


# ---- HouseExpo

OUTLINE = [[0, 0], [8, 0], [8, 6], [4.1, 6], [4.1, 1.2], [4.0, 1.2], [4.0, 6], [0, 6]]
"""Two rooms; the wall between them ends 1.2 m above the lower wall."""


def draw_houseexpo(**changes):
    box = {"min": [0, 0], "max": [8, 6]}
    rooms = {"Kitchen": [[0, 0, 4, 6]], "Bedroom": [[4.1, 0, 8, 6]]}
    return {"id": "home", "verts": OUTLINE, "bbox": box, "room_category": rooms, **changes}


def test_houseexpo(tmp_path):
    plan = load_floorplan(save(tmp_path / "h.json", draw_houseexpo()))
    assert plan.name == "home" and {label.name for label in plan.labels} == {"Kitchen", "Bedroom"}
    assert 44 < plan.area_m2 < 48 and FreeSpace(plan).regions.max() == 1
    assert free_at(plan, 4.05, 0.6) and not free_at(plan, 4.05, 3.0)
    assert np.allclose(plan.walls.rows[:, 6], 2.5)
    closed = load_floorplan(save(tmp_path / "h.json", draw_houseexpo(verts=[*OUTLINE, OUTLINE[0]])))
    assert np.array_equal(closed.free, plan.free)
    thin = [[0, 0], [8, 0], [8, 6], [4, 6], [4, 1.2], [4, 6], [0, 6]]  # there and back: a wall without thickness
    assert FreeSpace(load_floorplan(save(tmp_path / "h.json", draw_houseexpo(verts=thin)))).regions.max() == 1


@pytest.mark.parametrize(
    ("changes", "match"),
    [
        ({"verts": None}, "found none"),
        ({"verts": [[0, 0], [1, 1]]}, "found 2 points"),
        ({"verts": [[0, 0], [8, 6], [8, 0], [0, 6]]}, r"crosses itself at \(4.00, 3.00\)"),
        ({"verts": (1000 * np.array(OUTLINE)).tolist()}, "0.001"),
        ({"bbox": {"min": [0, 0], "max": [80, 60]}}, "bbox"),
        ({"verts": [[0, 0], [float("nan"), 1], [1, 1]]}, "not a number"),
        ({"verts": [[0, 0], [1.1, 0], [1.1, 1.1], [0, 1.1]], "bbox": None}, "without a path"),
    ],
)
def test_bad_houseexpo_is_explained(tmp_path, changes, match):
    with pytest.raises(InputError, match=match) as caught:
        load_floorplan(save(tmp_path / "h.json", draw_houseexpo(**changes)))
    assert "h.json" in str(caught.value) and "\n" not in str(caught.value)


def test_houseexpo_without_outline(tmp_path):
    with pytest.raises(InputError, match="outline"):
        load_floorplan(save(tmp_path / "h.json", {"bbox": {}, "room_category": {}}))


def test_crossing_outlines_are_found():
    rng = np.random.default_rng(0)
    for _ in range(20):
        turns = np.sort(rng.uniform(0, 2 * np.pi, 12))
        star = np.column_stack([np.cos(turns), np.sin(turns)]) * rng.uniform(1, 3, (12, 1))
        assert find_crossing(star) is None or np.diff(turns).max() > np.pi
        star[[2, 7]] = star[[7, 2]]
        assert find_crossing(star) is not None


# ---- meshes


@pytest.fixture(scope="module")
def home():
    return generate_home(41)


def save_mesh(path, vertices, faces, up="z"):
    if up == "y":
        vertices = np.column_stack([vertices[:, 0], vertices[:, 2], -vertices[:, 1]])
    trimesh.Trimesh(vertices, faces, process=False).export(path)
    return path


@pytest.mark.parametrize(("ending", "up"), [("ply", "z"), ("glb", "y"), ("obj", "y"), ("stl", "z")])
def test_meshes(tmp_path, home, ending, up):
    mesh = floorplan_mesh(home, ceiling=float(home.walls.rows[0, 6]))
    plan = load_floorplan(save_mesh(tmp_path / f"m.{ending}", *mesh, up=up))
    cells = plan.frame.cell(home.frame.xy(np.argwhere(home.free)))
    assert plan.free[cells[:, 0], cells[:, 1]].mean() > 0.93, "nearly all free floor is found"
    assert plan.area_m2 < 1.03 * home.area_m2, "and no more than that"
    space = FreeSpace(plan)
    assert (space.regions == space.largest).sum() > 0.95 * space.traversable.sum()
    assert len(plan.walls) and len(plan.furniture)


def test_floor_is_found_at_any_height_and_up_is_an_option(tmp_path, home):
    vertices, faces = floorplan_mesh(home)
    plain = load_floorplan(save_mesh(tmp_path / "a.ply", vertices, faces))
    raised = load_floorplan(save_mesh(tmp_path / "b.ply", vertices + np.array([0.0, 0.0, 1.23]), faces))
    assert abs(raised.area_m2 - plain.area_m2) < 0.03 * plain.area_m2
    lying = load_floorplan(save_mesh(tmp_path / "c.ply", vertices[:, [2, 0, 1]], faces), up="x")
    assert abs(lying.area_m2 - plain.area_m2) < 0.03 * plain.area_m2
    small = load_floorplan(save_mesh(tmp_path / "d.ply", vertices * 1000, faces), resolution=0.001)
    assert abs(small.area_m2 - plain.area_m2) < 0.03 * plain.area_m2
    with pytest.raises(InputError, match="--up w"):
        load_floorplan(tmp_path / "a.ply", up="w")


def test_bad_meshes_are_explained(tmp_path, home):
    vertices, faces = floorplan_mesh(home)
    walls = box_mesh(home.walls)
    # walls without tops and bottoms
    tops = np.ptp(walls[0][walls[1]][..., 2], axis=1) < 1e-6
    posts = [
        [0.35 + 0.55 * i, 0.35 + 0.55 * j, 0, 0.15, 0.15, 0, 2.4]
        for i in range(7)
        for j in range(7)
        if (i, j) != (3, 3)
    ]
    sides = [
        [2, 0, 0, 4.1, 0.1, 0, 2.4],
        [2, 4, 0, 4.1, 0.1, 0, 2.4],
        [0, 2, 0, 0.1, 4.1, 0, 2.4],
        [4, 2, 0, 0.1, 4.1, 0, 2.4],
    ]
    forest = box_mesh(Boxes(np.array(posts + sides, dtype=float)))
    floor = np.array([[0, 0, 0], [4, 0, 0], [4, 4, 0], [0, 4, 0]], np.float32), np.array([[0, 1, 2], [0, 2, 3]])
    cases = {
        "millimetres": (vertices * 1000, faces),
        "centimetres": (vertices * 100, faces),
        "without a floor": (walls[0], walls[1][~tops]),
        "too small for a home": (vertices * 0.001, faces),
        "without a path": join_meshes(forest, floor),
    }
    for match, mesh in cases.items():
        with pytest.raises(InputError, match=match) as caught:
            load_floorplan(save_mesh(tmp_path / "m.ply", *mesh), up="z")
        assert "m.ply" in str(caught.value) and "\n" not in str(caught.value)
    (tmp_path / "m.glb").write_bytes(b"no mesh")
    with pytest.raises(InputError, match="cannot be read"):
        load_floorplan(tmp_path / "m.glb")
    trimesh.PointCloud(vertices).export(tmp_path / "p.ply")
    with pytest.raises(InputError, match=r"no triangles|cannot be read"):
        load_floorplan(tmp_path / "p.ply")
