"""Films."""

from pathlib import Path

import imageio.v2 as imageio
import pytest

from vinl.benchmark.evaluate import evaluate
from vinl.chain.config import EvaluationConfig
from vinl.policies.policy import LocomotionPolicy
from vinl.world.floorplan import FloorPlan


@pytest.mark.filterwarnings("ignore::ResourceWarning")
def test_film_shows_the_episode(two_rooms: FloorPlan, standing: LocomotionPolicy, tmp_path: Path) -> None:
    config = EvaluationConfig(time_limit=0.32)
    results = evaluate(
        [two_rooms], standing, "oracle", episodes=1, seeds=1, config=config, films="first", out=tmp_path / "films"
    )
    (name,) = results.videos
    with imageio.get_reader(tmp_path / "films" / name) as film:
        assert film.get_meta_data()["size"] == (1280, 720)
        frame = film.get_data(0)
    assert [path.name for path in (tmp_path / "films").iterdir()] == [name]
    assert frame[:600, :780].std() > 10  # the robot's picture is no blank
    assert frame[25:160, 810:1030].std() > 5  # nor is what the camera sees
