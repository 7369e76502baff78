"""The whole evaluation on a tiny home: same numbers from any number of processes, and a page that holds together."""

import json
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest

from vinl.benchmark.evaluate import evaluate
from vinl.benchmark.folders import results_as_dict
from vinl.benchmark.report import render_report
from vinl.chain.config import EvaluationConfig
from vinl.chain.records import Results
from vinl.config.output import check_out, strip_command, write_json
from vinl.policies.policy import LocomotionPolicy
from vinl.world.floorplan import FloorPlan

CONFIG = EvaluationConfig(time_limit=1.0)


@pytest.fixture(scope="module")
def results(two_rooms: FloorPlan, trotting: LocomotionPolicy) -> Results:
    return evaluate([two_rooms], trotting, "oracle", episodes=2, seeds=2, obstacles="paper", config=CONFIG)


def plain(results: Results) -> dict:
    """What must be the same twice."""
    data = json.loads(json.dumps(results_as_dict(results, ["vinl"])))
    del data["timing"], data["aggregate"]["wall_seconds"]
    return data


def test_same_numbers_from_two_processes(results: Results, two_rooms: FloorPlan, trotting: LocomotionPolicy) -> None:
    again = evaluate([two_rooms], trotting, "oracle", episodes=2, seeds=2, obstacles="paper", config=CONFIG, workers=2)
    assert plain(again) == plain(results)
    for a, b in zip(results.episodes, again.episodes, strict=True):
        np.testing.assert_array_equal(a.trace.path, b.trace.path)


def test_episodes_do_not_depend_on_their_number(
    results: Results, two_rooms: FloorPlan, trotting: LocomotionPolicy
) -> None:
    """Seed 1 alone gives what it gave beside seed 0."""
    alone = evaluate(
        [two_rooms], trotting, "oracle", episodes=2, seeds=1, first_seed=1, obstacles="paper", config=CONFIG
    )
    assert alone.records == results.records[2:]


def test_seeds_change_clutter_and_start_but_not_the_route(results: Results) -> None:
    first, second = results.episodes[0], results.episodes[2]
    assert (first.record.start, first.record.goal) == (second.record.start, second.record.goal)
    assert first.record.yaw != second.record.yaw
    assert not np.array_equal(first.trace.blocks, second.trace.blocks)
    ends = np.array([first.record.start, first.record.goal])
    assert np.linalg.norm(first.trace.blocks[:, None, :2] - ends, axis=-1).min() >= 1.5


def test_standing_robot_is_stuck(two_rooms: FloorPlan, standing: LocomotionPolicy) -> None:
    config = EvaluationConfig(time_limit=2.0, stuck_window=1.0)
    told = []
    record = evaluate(
        [two_rooms], standing, episodes=1, seeds=1, config=config, on_progress=lambda *x: told.append(x)
    ).records[0]
    assert (record.success, record.fell, record.end_reason) == (False, False, "stuck")
    assert record.end_at == "free"
    assert record.time_s == pytest.approx(2.0)
    assert record.distance_m < 0.1
    assert (record.foot_steps, record.leg_contact_steps, record.paper_foot_steps) == (0, 0, 0)
    assert told == [("plan", 0, 1), ("walk", 0, 1), *[("second", k, 2) for k in (0, 1, 2, 2)], ("walk", 1, 1)]


def test_results_file_has_the_names_that_others_read(results: Results, tmp_path: Path) -> None:
    write_json(tmp_path / "deep" / "results.json", results_as_dict(results, ["vinl", "eval"]))
    data = json.loads((tmp_path / "deep" / "results.json").read_text())
    assert {"schema", "command", "config", "policies", "episodes", "aggregate"} <= data.keys()
    assert {
        "plan", "episode", "seed", "start", "goal", "success", "end_reason", "time_s", "distance_m", "geodesic_m",
        "spl", "soft_spl", "foot_block_steps", "foot_wall_steps", "leg_contact_steps", "paper_foot_steps",
        "fell", "speed_rmse",
    } <= data["episodes"][0].keys()  # fmt: skip
    for name in ("success", "spl", "soft_spl", "distance_m", "foot_collisions_per_m", "foot_block_per_m",
                 "foot_wall_per_m", "leg_contacts_per_m", "paper_foot_collisions_per_m"):  # fmt: skip
        assert data["aggregate"][name].keys() == {"mean", "std_over_seeds", "ci95"}
    assert {"falls", "episodes", "wall_seconds"} <= data["aggregate"].keys()
    assert [p.name for p in (tmp_path / "deep").iterdir()] == ["results.json"]  # no scratch file stays


def test_report_is_well_formed_and_complete(results: Results) -> None:
    page = render_report(results, "vinl eval --floorplans <a> & 'b'")
    tree = ET.fromstring(page.replace("<!DOCTYPE html>\n", ""))
    ids = {element.get("id") for element in tree.iter() if element.get("id")}
    assert {"headline", "paper", "histograms", "failures", "command", "e0", "e3"} <= ids
    classes = [element.get("class", "") for element in tree.iter()]
    assert classes.count("map") == 1
    assert classes.count("histogram") == 4
    assert sum(name.startswith("ep ") for name in classes) == 4
    assert sum(name == "pick" for name in classes) == 8  # all episodes failed: once below the map, once as failures
    assert "http" not in page.replace("http-equiv", "")  # nothing is fetched


def test_command_without_what_figures_do_not_depend_on() -> None:
    assert strip_command(["--out", "x", "--seeds", "2", "--workers=3"]) == ["--seeds", "2"]


def test_out_must_not_be_a_file(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    for out in (tmp_path / "file", tmp_path / "file" / "below"):
        with pytest.raises(ValueError, match="is a file"):
            check_out(out)
    assert check_out(tmp_path / "new" / "below") == tmp_path / "new" / "below"


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"episodes": 0}, "--episodes"),
        ({"seeds": -1}, "--seeds"),
        ({"workers": 0}, "--workers"),
        ({"obstacles": "papr"}, "did you mean 'paper'"),
        ({"navigator": "magic"}, "unknown navigator"),
        ({"films": "first"}, "folder"),
    ],
)
def test_bad_options(two_rooms: FloorPlan, standing: LocomotionPolicy, options: dict, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        evaluate([two_rooms], standing, **options)
