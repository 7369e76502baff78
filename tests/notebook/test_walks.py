"""What a notebook says in one line: plans with clutter, a walk, its pictures and its film."""

import gc
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

import vinl
from vinl.config.errors import InputError
from vinl.notebook.film import cut_episode

PLAN = "harbour_flat"
SHORT = vinl.EvaluationConfig(time_limit=2.0, min_distance=2.0)


@pytest.fixture(scope="module")
def walk() -> vinl.Walk:
    return vinl.walk(PLAN, "rough", config=SHORT, episode=1, seed=3)


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
    results = vinl.evaluate([plan], "rough", "oracle", 2, 1, 3, obstacles="paper", config=SHORT)
    assert results.records[1] == walk.record
    assert len(walk.trace.poses) == 50 and len(walk.blocks) == walk.record.blocks > 10


def test_pictures_of_a_walk(walk: vinl.Walk) -> None:
    assert np.asarray(walk.draw()).std() > 10
    start, later = walk.see(0.0), walk.see(2.0, vinl.NAVIGATION_CAMERA)
    assert start.shape == (36, 64) and 0.1 < start.min() < start.max() <= 2.0 and later.shape == (48, 80)
    views = walk.draw_views(1.0)
    assert views.size == (384 + 8 + 360, 216)
    with pytest.raises(InputError, match="between 0 and 2 s"):
        walk.see(2.1)


def test_film_of_a_part_plays_inside_the_page_and_leaves_nothing(walk: vinl.Walk, tmp_path) -> None:
    film = vinl.show_video(walk, start=1.0, stop=1.3)
    place = film.path.parent
    assert film.path.stat().st_size > 5_000
    assert film._repr_html_().startswith('<video controls width="800" src="data:video/mp4;base64,AAAA')
    del film
    gc.collect()
    assert not place.exists()
    kept = vinl.show_video(walk, tmp_path, stop=0.1).path
    gc.collect()
    assert kept.exists() and kept.parent == tmp_path


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
    for options, words in (({"obstacles": "papr"}, "did you mean"), ({"episode": -1}, "negative")):
        with pytest.raises(InputError, match=words):
            vinl.walk(PLAN, "rough", **options)
