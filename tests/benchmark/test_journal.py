"""What is kept of an evaluation that was interrupted, and what is refused."""

import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from vinl.benchmark.evaluate import evaluate_rows
from vinl.benchmark.journal import Journal, describe_differences, read_about, read_episodes, read_plans
from vinl.benchmark.protocol import Protocol, Row
from vinl.chain.choose import load_navigator
from vinl.chain.config import EvaluationConfig
from vinl.chain.records import Results
from vinl.config.errors import InputError
from vinl.policies.policy import LocomotionPolicy
from vinl.world.floorplan import FloorPlan

CONFIG = EvaluationConfig(time_limit=0.4)
EPISODES = "episodes.jsonl"


def run(plan: FloorPlan, policy: LocomotionPolicy, folder: Path, config: EvaluationConfig = CONFIG, **rest) -> Results:
    row = Row(policy, load_navigator("oracle", config), rest.pop("obstacles", "paper"))
    protocol = Protocol([plan], rest.pop("episodes", 2), range(2), config)
    return evaluate_rows([row], protocol, 1, [folder], keep=True, **rest)[0]


@pytest.fixture
def folder(two_rooms: FloorPlan, trotting: LocomotionPolicy, tmp_path: Path) -> Path:
    run(two_rooms, trotting, tmp_path / "run")
    return tmp_path / "run"


def test_only_what_is_missing_is_walked(folder: Path, two_rooms: FloorPlan, trotting: LocomotionPolicy) -> None:
    whole = (folder / EPISODES).read_bytes()
    before = list(read_episodes(folder))
    assert len(before) == 4
    lines = whole.splitlines(keepends=True)
    # killed in the middle of the third episode's line
    (folder / EPISODES).write_bytes(b"".join(lines[:3]) + lines[3][:100])
    told: list[tuple[str, int, int]] = []
    results = run(two_rooms, trotting, folder, on_progress=lambda *x: told.append(x))
    assert [x for x in told if x[0] == "walk"] == [("walk", 2, 4), ("walk", 3, 4), ("walk", 4, 4)]
    assert {e.record.key: e.record for e in before} == {r.key: r for r in results.records}
    for a, b in zip(sorted(before, key=lambda e: e.record.key), results.episodes, strict=True):
        np.testing.assert_array_equal(a.trace.path, b.trace.path)
        np.testing.assert_array_equal(a.trace.contacts, b.trace.contacts)
        np.testing.assert_array_equal(a.trace.blocks, b.trace.blocks)
    size = (folder / EPISODES).stat().st_size
    run(two_rooms, trotting, folder)
    assert (folder / EPISODES).stat().st_size == size  # all there: nothing is appended


def test_two_at_once_are_refused(folder: Path, two_rooms: FloorPlan, trotting: LocomotionPolicy) -> None:
    about, kept = read_about(folder), (folder / EPISODES).read_bytes()
    journal = Journal(folder, about, [two_rooms])
    for fresh in (False, True):
        with pytest.raises(InputError, match="another vinl eval is writing there"):
            run(two_rooms, trotting, folder, fresh=fresh)
    assert (folder / EPISODES).read_bytes() == kept and read_about(folder) == about
    journal.close()
    run(two_rooms, trotting, folder)


def test_fresh_begins_anew(folder: Path, two_rooms: FloorPlan, trotting: LocomotionPolicy) -> None:
    told: list[tuple[str, int, int]] = []
    run(two_rooms, trotting, folder, fresh=True, on_progress=lambda *x: told.append(x))
    assert ("walk", 0, 4) in told
    assert len(list(read_episodes(folder))) == 4
    run(two_rooms, trotting, folder, EvaluationConfig(time_limit=0.2), fresh=True)
    assert read_about(folder)["config"]["evaluation"]["time_limit"] == 0.2


def test_an_episode_is_walked_again_for_its_film(
    folder: Path, two_rooms: FloorPlan, trotting: LocomotionPolicy
) -> None:
    """Poses are not kept; the episode comes out as before, and its line stays."""
    row = Row(trotting, load_navigator("oracle", CONFIG), "paper")
    protocol = Protocol([two_rooms], 2, range(2), CONFIG, films="first")
    before, kept = list(read_episodes(folder)), (folder / EPISODES).read_bytes()
    told: list[tuple[str, int, int]] = []
    for walked in (1, 0):
        results = evaluate_rows([row], protocol, 1, [folder], keep=True, on_progress=lambda *x: told.append(x))[0]
        assert results.videos == ["two_rooms_episode0_seed0.mp4"] and (folder / results.videos[0]).exists()
        assert next(x for x in told if x[0] == "walk") == ("walk", 4 - walked, 4)
        assert (folder / EPISODES).read_bytes().count(b"record") == 4
        assert {r.key: r for r in results.records} == {e.record.key: e.record for e in before}
        told.clear()
    assert (folder / EPISODES).read_bytes().startswith(kept)
    film = folder / "two_rooms_episode0_seed0.mp4"
    film.write_bytes(b"of another robot")
    evaluate_rows([row], protocol, 1, [folder], keep=True, fresh=True)
    assert film.stat().st_size > 1000


def test_another_evaluation_is_refused(
    folder: Path, two_rooms: FloorPlan, trotting: LocomotionPolicy, standing: LocomotionPolicy
) -> None:
    changes: list[tuple[dict[str, Any], str]] = [
        ({"config": EvaluationConfig(time_limit=0.5)}, r"config.evaluation.time_limit is 0.4 there and 0.5 now"),
        ({"episodes": 3}, r"config.episodes_per_plan is 2 there and 3 now"),
        ({"obstacles": "none"}, r'config.obstacles.preset is "paper" there and "none" now'),
    ]
    for change, words in changes:
        with pytest.raises(InputError, match=f"{words}.*another --out, or give --fresh"):
            run(two_rooms, trotting, folder, **change)
    with pytest.raises(InputError, match=r'policies.locomotion.name is "trotting" there and "standing" now'):
        run(two_rooms, standing, folder)


def test_same_name_other_weights_is_refused(
    folder: Path, two_rooms: FloorPlan, trotting: LocomotionPolicy, standing: LocomotionPolicy
) -> None:
    other = LocomotionPolicy(standing.network, trotting.card)
    with pytest.raises(InputError, match=r"policies.locomotion.weights_sha256"):
        run(two_rooms, other, folder)


def test_new_figures_on_a_card_do_not_stop_a_run(
    folder: Path, two_rooms: FloorPlan, trotting: LocomotionPolicy
) -> None:
    card = replace(trotting.card, evaluation={"loco": {"falls": 0.0}})
    size = (folder / EPISODES).stat().st_size
    run(two_rooms, LocomotionPolicy(trotting.network, card), folder)
    assert (folder / EPISODES).stat().st_size == size
    with pytest.raises(InputError, match="another evaluation"):
        run(two_rooms, LocomotionPolicy(trotting.network, replace(card, samples=card.samples + 1)), folder)


def test_a_broken_line_is_named(folder: Path, two_rooms: FloorPlan, trotting: LocomotionPolicy) -> None:
    lines = (folder / EPISODES).read_bytes().splitlines(keepends=True)
    (folder / EPISODES).write_bytes(lines[0] + b'{"record": {}}\n' + lines[1])
    with pytest.raises(InputError, match="line 2 is broken"):
        run(two_rooms, trotting, folder)


@pytest.mark.parametrize("wrong", ['"0.5"', '"NaN"', "true", "null", "1e99", "[0.5]"])
def test_a_figure_that_is_no_number_is_named(
    wrong: str, folder: Path, two_rooms: FloorPlan, trotting: LocomotionPolicy
) -> None:
    text = (folder / EPISODES).read_text()
    (folder / EPISODES).write_text(re.sub(r'"spl": [^,]+', f'"spl": {wrong}', text, count=1))
    with pytest.raises(InputError, match=r"line 2 is broken \(spl is "):
        run(two_rooms, trotting, folder)


def test_plans_come_back_as_they_were(folder: Path, two_rooms: FloorPlan) -> None:
    (plan,) = read_plans(folder, read_about(folder))
    assert (plan.name, plan.source) == ("two_rooms", "test")
    np.testing.assert_array_equal(plan.inside, two_rooms.inside)
    np.testing.assert_array_equal(plan.free, two_rooms.free)
    np.testing.assert_allclose(plan.boxes.rows, two_rooms.boxes.rows)


def test_episodes_without_their_description_are_refused(
    folder: Path, two_rooms: FloorPlan, trotting: LocomotionPolicy
) -> None:
    (folder / "run.json").unlink()
    with pytest.raises(InputError, match=r"no run.json"):
        run(two_rooms, trotting, folder)
    (folder / "run.json").write_text(json.dumps({"schema": 99}))
    with pytest.raises(InputError, match="another version"):
        run(two_rooms, trotting, folder)


def test_differences_in_words() -> None:
    one, other = {"a": 1, "b": {"c": [1, 2]}, "d": 0}, {"a": 1, "b": {"c": [1, 3]}, "e": 0}
    assert describe_differences(one, other, ("here", "there")) == (
        "b.c[1] is 2 here and 3 there; d is 0 here and null there; e is null here and 0 there"
    )
    assert describe_differences(one, one, ("", "")) == ""
