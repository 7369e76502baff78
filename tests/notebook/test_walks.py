"""What a notebook says in one line: plans with clutter, a walk, its pictures and its film."""

import gc
import re
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
import torch
from PIL import Image
from torch.nn.modules.module import register_module_forward_pre_hook

import vinl
from vinl.chain import workers
from vinl.config.errors import InputError
from vinl.notebook.walk import cut_episode

pytestmark = pytest.mark.slow

PLAN = "harbour_flat"
SHORT = vinl.EvaluationConfig(time_limit=2.0, min_distance=2.0)


@pytest.fixture(scope="module")
def walk() -> vinl.Walk:
    return vinl.walk(PLAN, "rough", "oracle", config=SHORT, episode=1, seed=3)


def test_same_seed_same_routes_and_clutter() -> None:
    routes = vinl.sample_routes(PLAN, 3, seed=5)
    again = vinl.sample_routes(vinl.load_floorplan(PLAN), 3, seed=5)
    assert [r.start.tolist() for r in routes] == [r.start.tolist() for r in again]
    assert min(r.straight_m for r in routes) >= 5.0
    blocks = vinl.scatter_clutter(PLAN, "dense", seed=1, routes=routes)
    np.testing.assert_array_equal(blocks.rows, vinl.scatter_clutter(PLAN, "dense", seed=1, routes=routes).rows)
    clear = [np.linalg.norm(blocks.rows[:, :2] - point, axis=1).min() for r in routes for point in (r.start, r.goal)]
    assert min(clear) >= 1.5
    assert len(vinl.scatter_clutter(PLAN, "none")) == 0 < len(vinl.scatter_clutter(PLAN)) < len(blocks) * 2
    with pytest.raises(InputError, match="did you mean 'paper'"):
        vinl.scatter_clutter(PLAN, "papr")


def test_plan_is_a_picture_that_shows_the_clutter() -> None:
    bare = vinl.draw_plan(PLAN)
    full = vinl.draw_plan(PLAN, vinl.scatter_clutter(PLAN), vinl.sample_routes(PLAN))
    assert isinstance(bare, Image.Image) and bare.size == full.size and min(bare.size) > 400
    assert np.abs(np.asarray(bare, int) - np.asarray(full, int)).max() > 100


def test_walk_is_the_episode_of_an_evaluation(walk: vinl.Walk) -> None:
    plan = vinl.load_floorplan(PLAN)
    results = vinl.evaluate([plan], "rough", "oracle", 2, 1, first_seed=3, obstacles="paper", config=SHORT)
    assert results.records[1] == walk.record
    assert len(walk.trace.poses) == 50 and len(walk.blocks) == walk.record.blocks > 10


def test_pictures_of_a_walk(walk: vinl.Walk) -> None:
    assert np.asarray(walk.draw()).std() > 10
    start, later = walk.see(0.0), walk.see(2.0, vinl.NAVIGATION_CAMERA)
    assert start.shape == (56, 96) and 0.1 < start.min() < start.max() <= 2.0 and later.shape == (60, 80)
    views = walk.draw_views(1.0)
    assert views.size == (370 + 8 + 288, 216)
    with pytest.raises(InputError, match="between 0 and 2 s"):
        walk.see(2.1)


def test_film_of_a_part_plays_inside_the_page_and_leaves_nothing(walk: vinl.Walk, tmp_path) -> None:
    film = vinl.show_video(walk, 1.0, 1.3)
    place = film.path.parent
    assert film.path.stat().st_size > 5_000
    assert film._repr_html_().startswith('<video controls width="800" src="data:video/mp4;base64,AAAA')
    del film
    gc.collect()
    assert not place.exists()
    kept = vinl.show_video(walk, stop=0.1, out=tmp_path).path
    gc.collect()
    assert kept.exists() and kept.parent == tmp_path


def test_wrong_words_of_a_film(walk: vinl.Walk, tmp_path) -> None:
    (tmp_path / "file").write_text("")
    for arguments, words in (
        ((walk, 0.0, 0.1, tmp_path / "file" / "film"), "is a file"),
        ((walk, 0.0, 0.1, "/proc/films"), "nothing can be written there"),
    ):
        with pytest.raises(InputError, match=words):
            vinl.show_video(*arguments)


def test_what_is_shown_at_a_prompt_is_short(walk: vinl.Walk) -> None:
    """The last line of a cell, or print(): one line, and in a notebook a picture or a table."""
    plan = vinl.load_floorplan(PLAN)
    results = vinl.evaluate(PLAN, "rough", "oracle", 1, 1, obstacles="none", config=SHORT)
    for shown in (walk, walk.episode, walk.trace, walk.blocks, plan, plan.walls, results, vinl.load_policy("rough")):
        assert len(repr(shown)) < 160 and "\n" not in repr(shown) and type(shown).__name__ in repr(shown)
    assert 'src="data:image/png;base64,iVBOR' in walk._repr_html_() and "harbour_flat" in walk._repr_html_()
    table = results._repr_html_()
    assert "1 episode in 1 floor plan," in repr(results)
    assert table.count("<tr>") == 3 and "<td>harbour_flat</td><td>1</td>" in table


def test_cameras_have_names(walk: vinl.Walk) -> None:
    np.testing.assert_array_equal(walk.see(1.0, "navigation"), walk.see(1.0, vinl.NAVIGATION_CAMERA))
    with pytest.raises(InputError, match="did you mean 'navigation'"):
        walk.see(1.0, "navigatoin")
    seeing = vinl.walk(PLAN, config=replace(SHORT, time_limit=0.5))
    assert seeing.cameras["navigation"] == vinl.load_policy("nav").camera
    assert seeing.cameras["locomotion"] == vinl.load_policy("loco").camera


def test_defaults_are_the_product() -> None:
    """``loco`` with ``nav`` through the paper's clutter, whoever asks."""
    rules = replace(SHORT, time_limit=0.5)
    walk, results = vinl.walk(PLAN, config=rules), vinl.evaluate(PLAN, episodes=1, seeds=1, config=rules)
    assert results.policies["locomotion"]["name"] == "loco" and results.policies["navigation"]["name"] == "nav"
    assert results.config["obstacles"]["preset"] == "paper" and results.records[0] == walk.record


def test_torch_works_with_one_thread_and_gets_its_own_back() -> None:
    """More of them are slower by far: the networks are small."""
    seen: list[int] = []
    hook = register_module_forward_pre_hook(lambda *_: seen.append(torch.get_num_threads()))
    before = torch.get_num_threads()
    torch.set_num_threads(3)
    try:
        rules = replace(SHORT, time_limit=0.5)
        vinl.walk(PLAN, config=rules)
        vinl.evaluate(PLAN, episodes=1, seeds=1, config=rules)
        assert torch.get_num_threads() == 3 and seen and set(seen) == {1}
    finally:
        hook.remove()
        torch.set_num_threads(before)


def test_a_bar_is_shown_to_those_who_watch(monkeypatch: pytest.MonkeyPatch, capsys) -> None:
    monkeypatch.setattr(workers, "_DELAY", 0.0)
    rules = replace(SHORT, time_limit=1.0)
    vinl.walk(PLAN, "rough", "oracle", config=rules)
    assert capsys.readouterr().err == ""
    monkeypatch.setattr(workers, "is_watched", lambda: True)
    monkeypatch.setenv("FORCE_COLOR", "1")
    vinl.walk(PLAN, "rough", "oracle", config=rules)
    bar = capsys.readouterr().err
    shown = re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", bar).split("\r")
    assert any("walking:" in line and "/1 s" in line and "left" in line for line in shown)
    assert max(len(line.rstrip("\n")) for line in shown) <= 80


def test_part_of_an_episode(walk: vinl.Walk) -> None:
    trace = replace(walk.trace, contacts=np.array([[0.5, 0, 1, 2], [1.2, 1, 3, 4], [1.9, 0, 5, 6]]))
    episode = replace(walk.episode, trace=trace)
    part = cut_episode(episode, 1.0, 1.6)
    assert len(part.trace.poses) == len(part.trace.commands) == 15 and part.record.end_reason == ""
    np.testing.assert_allclose(part.trace.contacts, [[0.2, 1, 3, 4]])
    np.testing.assert_array_equal(part.trace.poses[0], trace.poses[25])
    assert cut_episode(episode, 1.0, None).record.end_reason == walk.record.end_reason
    for start, stop in ((-1.0, None), (1.0, 1.0), (2.5, None)):
        with pytest.raises(InputError, match="nothing to show"):
            cut_episode(episode, start, stop)


def test_bad_words() -> None:
    with pytest.raises(InputError, match="did you mean 'harbour_flat'"):
        vinl.walk("harbor_flat")
    for options, words in (({"obstacles": "papr"}, "did you mean"), ({"episode": -1}, "from 0 on")):
        with pytest.raises(InputError, match=words):
            vinl.walk(PLAN, "rough", **options)


WRONG = {
    "vinl.evaluate(3)": "a floor plan is a name, a file or a FloorPlan, got int",
    "vinl.evaluate([3])": "a floor plan is a name, a file or a FloorPlan, got int",
    "vinl.evaluate('harbour_flat', episodes='x')": "--episodes must be a number, got 'x'",
    "vinl.evaluate('harbour_flat', films='first', out='/proc/films')": "nothing can be written there",
    "vinl.walk('harbour_flat', episode='x')": "episode and seed are whole numbers from 0 on, got 'x' and 0",
    "vinl.walk('harbour_flat', config={'time_limit': 1})": "config must be an EvaluationConfig, got dict",
    "vinl.generate_home('x')": "the seed must be a number, got 'x'",
    "vinl.walk('harbour_flat', 'rough', print)": "as_navigator",
    "vinl.walk('harbour_flat', print)": "as_locomotor",
    "vinl.walk('harbour_flat', 'nav')": "nav is a navigation policy",
    "vinl.walk('harbour_flat', 'loco', 'loco')": "loco is a locomotion policy",
    "vinl.show_video('harbour_flat')": "what vinl.walk returns, got str",
    "vinl.show_video(walk, 0, 'x')": "stop is a time [s], got 'x'",
    "walk.see('navigation')": "time is seconds since the start, got 'navigation'",
}


def test_wrong_kinds_are_explained() -> None:
    """In a process of its own: here every argument's type is checked, which a user's process does not do."""
    code = """import vinl
walk = vinl.walk("harbour_flat", "rough", "oracle", config=vinl.EvaluationConfig(time_limit=0.5))
for call in {}:
    try:
        eval(call)
    except vinl.InputError as error:
        print(error)"""
    command = [sys.executable, "-c", code.format(list(WRONG))]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    lines = done.stdout.splitlines()
    assert len(lines) == len(WRONG), done.stdout + done.stderr
    for line, words in zip(lines, WRONG.values(), strict=True):
        assert words in line
