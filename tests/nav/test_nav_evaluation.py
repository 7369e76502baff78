"""The navigator alone: the same episodes for every policy, honest ends, figures and a page; bad options in one line."""

import gzip
import json
from dataclasses import replace

import numpy as np
import pytest
from rich.console import Console

from vinl.benchmark.routes import place_route
from vinl.chain.config import EvaluationConfig
from vinl.chain.episode import draw_routes
from vinl.chain.metrics import spl
from vinl.cli.app import main
from vinl.config.errors import InputError
from vinl.config.loader import build_config, load_config
from vinl.config.paths import assets_dir
from vinl.nav.config import NavConfig
from vinl.nav.evaluation import (
    NavEvaluation,
    NavRecord,
    build_homes,
    describe_episodes,
    evaluate_kind,
    load_navigator,
    name_kind,
)
from vinl.nav.home_store import HomeStore
from vinl.nav.recurrent_model import build_actor
from vinl.nav.report import aggregate_by_distance, choose_drawn, count_failures, print_failures
from vinl.nav.training import check_seeds, make_card
from vinl.policies.io import save_policy
from vinl.world.free_space import FreeSpace
from vinl.world.readers import expand_paths, load_floorplan
from vinl.world.start_goal import measure_route

TINY = {"camera": {"width": 32, "height": 24, "mount_height": 0.3}, "network": {"vision": "cnn", "hidden": 8}}


@pytest.fixture
def untrained(tmp_path):
    config = build_config(NavConfig, TINY)
    save_policy(tmp_path / "tiny", build_actor(config), make_card("tiny", config, 7, "abc"))
    return str(tmp_path / "tiny")


def results(tmp_path, *more: str) -> dict:
    out = tmp_path / f"out-{len(list(tmp_path.glob('out-*')))}"
    assert main(["eval-nav", "--floorplans", "harbour_flat", "--episodes", "6", "--out", str(out), *more]) == 0
    assert (out / "report.html").read_text().count("<svg") >= 7
    return json.loads((out / "results.json").read_text())


def test_the_oracle_arrives_and_an_untrained_policy_does_not(tmp_path, untrained):
    oracle = results(tmp_path, "--policy", "oracle")
    poor = results(tmp_path, "--policy", untrained, "--steps", "12")
    assert oracle["aggregate"]["success"]["mean"] > 0.8 and oracle["aggregate"]["spl"]["mean"] > 0.7
    assert poor["aggregate"]["success"]["mean"] == 0.0 and poor["aggregate"]["end_reasons"]["success"] == 0
    same = ("start", "goal", "yaw", "geodesic_m", "plan", "episode")
    for a, b in zip(oracle["episodes"], poor["episodes"], strict=True):
        assert all(a[key] == b[key] for key in same)
        assert a["geodesic_m"] >= max(4.85, a["straight_m"])  # the range holds for the environment's coarser grid
    assert sum(poor["aggregate"]["end_reasons"].values()) == poor["aggregate"]["episodes"] == 6
    assert poor["policies"]["navigation"]["trained_in"]["seed"] == 1
    assert list(oracle["kinds"]) == ["shipped"] and oracle["kinds"]["shipped"]["distances"]


def test_paths_end_where_the_record_says(untrained):
    rules = NavEvaluation(episodes=8, steps=120)
    config = describe_episodes(None, rules)
    (store,) = build_homes(config, 0, 5, ["harbour_flat"], "cpu").values()
    kind = evaluate_kind(None, "shipped", store, config)
    assert len(kind.records) == len(kind.traces) == 8
    for record, trace in zip(kind.records, kind.traces, strict=True):
        length = np.linalg.norm(np.diff(trace.path, axis=0), axis=1).sum()
        assert length == pytest.approx(record.distance_m, abs=0.1 + 0.02 * record.distance_m)
        assert record.success == (record.end_reason == "success")
        assert len(trace.path) == round(record.time_s / 0.5) + 1
        left = np.linalg.norm(trace.path[-1] - record.goal)
        assert not record.success or left < 0.33


def test_shortest_paths_and_spl_are_those_of_the_whole_chain():
    plan = load_floorplan("harbour_flat")
    config, space = describe_episodes(None, NavEvaluation(episodes=6, steps=28)), FreeSpace(plan)
    kind = evaluate_kind(None, "shipped", HomeStore.from_plans([plan], config), config)
    for r in kind.records:
        route = place_route(space, np.array(r.start), np.array(r.goal))  # as of vinl eval --routes
        assert r.geodesic_m == pytest.approx(route.geodesic_m, abs=2e-3)
        assert r.spl == pytest.approx(spl(r.success, route.geodesic_m, r.distance_m), abs=1e-3)
    assert 0 < sum(r.success for r in kind.records) < 6
    for route in draw_routes(plan, 4, EvaluationConfig()):  # as of vinl eval
        again = measure_route(space, route.start, route.goal)
        assert again.geodesic_m == pytest.approx(route.geodesic_m, abs=1e-5)


def test_the_camera_is_the_policys_and_its_motion_the_rules(untrained):
    policy = load_navigator(untrained, "cpu")
    config = describe_episodes(policy.card, NavEvaluation(motion="paper"))
    assert (config.camera.width, config.camera.height, config.camera.mount_height) == (32, 24, 0.3)
    assert config.motion.uniform > 0.5 and config.episodes.steps == 250 and config.episodes.distance == (5.0, 30.0)
    assert describe_episodes(None, NavEvaluation()).camera is None


def test_it_drives_at_the_speeds_of_the_policys_card(untrained):
    slow = build_config(NavConfig, {**TINY, "robot": {"max_speed": 0.6, "max_yaw_rate": 0.8}})
    card = make_card("slow", slow, 7, "abc")
    assert (card.action["forward_speed"], card.action["yaw_rate"]) == ([0.0, 0.6], [-0.8, 0.8])
    robot = describe_episodes(card, NavEvaluation()).robot
    assert (robot.max_speed, robot.max_yaw_rate) == (0.6, 0.8)
    backwards = make_card("back", replace(slow, robot=replace(slow.robot, min_speed=-0.3)), 7, "abc")
    assert backwards.action["forward_speed"] == [-0.3, 0.6]
    assert describe_episodes(backwards, NavEvaluation()).robot.min_speed == -0.3
    restless = replace(card, action={"forward_speed": [0.1, 0.6]})
    with pytest.raises(InputError, match="can stand still"):
        describe_episodes(restless, NavEvaluation())


def test_the_robot_that_is_judged_is_as_wide_as_it_is_whatever_the_training_takes(monkeypatch):
    trained = load_config(NavConfig, "nav/motion/walking", ["robot.width=0.4", "robot.min_speed=-0.3"])
    monkeypatch.setattr("vinl.nav.evaluation.load_config", lambda *_: trained)
    robot = describe_episodes(None, NavEvaluation()).robot
    assert (robot.length, robot.width, robot.min_speed) == (0.65, 0.31, 0.0)
    assert robot.max_speed == trained.robot.max_speed


def record(success: bool, spl: float, geodesic: float = 6.0) -> NavRecord:
    end = "success" if success else "stuck"
    return NavRecord("p", 0, 0, (0, 0), (1, 1), 0, 5, geodesic, success, end, 9.0, 7.0, spl, spl, "g", 2, 1.0)


def test_classes_of_distance_and_what_is_drawn():
    records = [record(True, 0.9), record(False, 0.0, 12.0), *(record(True, 0.5 + k / 100) for k in range(20))]
    classes = aggregate_by_distance(records)
    assert [(c["from_m"], c["to_m"], c["episodes"]) for c in classes] == [(5.0, 7.5, 21), (10.0, 15.0, 1)]
    worst, middle = choose_drawn(records)
    assert worst[0] == 1 and len(worst) == 6 and len(middle) == 3 and not set(worst) & set(middle)


def test_failures_are_counted_by_kind_and_named_by_home(capsys):
    records = [record(True, 0.9), record(False, 0.0), record(False, 0.0), replace(record(False, 0.0), plan="q")]
    counted = count_failures(records)
    assert counted["lost"] == counted["reasons"]["stuck"] == 3 and counted["reasons"]["looping"] == 0
    assert list(counted["homes"].items()) == [("p", 2), ("q", 1)] and "success" not in counted["reasons"]
    print_failures(Console(width=100), {"offices": counted, "fine": count_failures(records[:1])})
    shown = capsys.readouterr().out
    assert "offices" in shown and "p: 2, q: 1" in shown
    print_failures(Console(), {"fine": count_failures(records[:1])})
    assert capsys.readouterr().out == ""


def test_sets_that_judge_are_never_trained_on(tmp_path):
    out = tmp_path / "out"
    options = ["--policy", "oracle", "--sets", "dead_ends", "--episodes", "8", "--steps", "4", "--drift", "0.02"]
    assert main(["eval-nav", *options, "--out", str(out)]) == 0
    data = json.loads((out / "results.json").read_text())
    assert data["kinds"]["dead_ends"]["homes"] == 20 and data["config"]["drift"] == 0.02
    assert all(int(episode["plan"].removeprefix("home-")) >= 2_100_000_000 for episode in data["episodes"])
    check_seeds(build_config(NavConfig, {"homes": {"seed": 900_000_000}}), 2)
    with pytest.raises(InputError, match="kept for judging"):
        check_seeds(build_config(NavConfig, {"homes": {"seed": 999_000_000}}), 2)


def write_houses(path, count: int) -> str:
    """A JSON lines file of one shipped home again and again; plan 1 is a house of one tiny room."""
    home = json.loads((assets_dir() / "floorplans" / "harbour_flat.json").read_text())
    corners = [[0, 0], [0.9, 0], [0.9, 0.9], [0, 0.9]]
    sides = [{"from": a, "to": b, "thickness": 0.1} for a, b in zip(corners, corners[1:] + corners[:1], strict=True)]
    tiny = {**home, "rooms": [{"name": "box", "outline": corners}], "walls": sides}
    tiny |= {"doors": [], "windows": [], "furniture": []}
    with gzip.open(path, "wt") as lines:
        for k in range(count):
            lines.write(json.dumps(tiny if k == 1 else home) + "\n")
    return str(path)


def test_ranges_of_plans_are_judged_and_what_is_none_is_counted(tmp_path):
    houses = write_houses(tmp_path / "houses.jsonl.gz", 5)
    assert expand_paths([f"{houses}:1-3", "b.yaml"]) == [*(f"{houses}:{k}" for k in (1, 2, 3)), "b.yaml"]
    assert expand_paths([f"{houses}:3-"]) == expand_paths([f"{houses}:3:5"]) == [f"{houses}:3", f"{houses}:4"]
    assert expand_paths([f"{houses}:0-/2"]) == expand_paths([f"{houses}:0:5:2"])
    for bad, words in (("3-2", "names no plan"), ("0-9", "holds 5 plans, 0 to 4"), ("5-", "names no plan")):
        with pytest.raises(InputError, match=words):
            expand_paths([f"{houses}:{bad}"])
    with pytest.raises(InputError, match="no such file"):
        expand_paths([f"{tmp_path}/none.jsonl:0-3"])
    out = tmp_path / "out"
    options = ["--policy", "oracle", "--episodes", "6", "--steps", "3", "--out", str(out)]
    assert main(["eval-nav", *options, "--floorplans", f"{houses}:1-2"]) == 0
    data = json.loads((out / "results.json").read_text())
    kind = data["kinds"]["houses"]
    assert kind["homes"] == kind["dropped"] == 1 and len(kind["reasons"]) == 1
    assert "houses.jsonl.gz:1: the plan is too small" in kind["reasons"][0]
    assert (out / "report.html").exists()


def test_training_takes_ranges_and_drops_what_is_no_home(tmp_path):
    houses = write_houses(tmp_path / "houses.jsonl.gz", 4)
    few = {"count": 6, "workers": 0, "goals": 2, "starts": 32, "plans": [f"{houses}:0-1"], "plans_share": 1.0}
    store = HomeStore.build(build_config(NavConfig, {"homes": few}))
    assert {record.name for record in store.records} == {"harbour_flat"}
    assert store.reasons
    with pytest.raises(InputError, match="no such file"):
        HomeStore.build(build_config(NavConfig, {"homes": {**few, "plans": ["nowhere.jsonl:0-1"]}}))


def test_kinds_of_floor_plans():
    kinds = [name_kind(p) for p in ("harbour_flat", "x/houses.jsonl.gz:3", "m/lab.yaml", "p.png")]
    assert kinds == ["shipped", "houses", "ros_map", "picture"]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--policy", "rough"], "navigator"),
        (["--policy", "nothing"], "nothing"),
        (["--policy", "oracle", "--motion", "wild"], "--motion"),
        (["--policy", "oracle", "--episodes", "0"], "--episodes"),
        (["--policy", "oracle", "--min-distance", "50"], "--min-distance"),
        (["--policy", "oracle", "--homes", "0"], "--homes"),
        (["--policy", "oracle", "--floorplans", "nowhere.json"], "nowhere.json"),
    ],
)
def test_bad_options_are_one_line(arguments, message, capsys, tmp_path):
    assert main(["eval-nav", "--out", str(tmp_path / "out"), *arguments]) == 2
    error = capsys.readouterr().err
    assert message in error and len(error.strip().splitlines()) == 1
    assert not (tmp_path / "out").exists()
