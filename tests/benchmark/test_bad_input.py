"""What cannot be walked, and policies that make no sense: one clear line each, or an episode that says so."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
import yaml
from tiny_networks import TinyGuide, TinyWalker

from vinl.benchmark.evaluate import evaluate
from vinl.benchmark.routes import place_route, read_routes
from vinl.chain.config import EvaluationConfig
from vinl.chain.navigators.learned import LearnedNavigator
from vinl.cli.app import main
from vinl.config.errors import InputError
from vinl.policies.card import locomotion_card, navigation_card
from vinl.policies.depth_policy import DepthPolicy
from vinl.policies.policy import LocomotionPolicy
from vinl.robot.cameras import LOCOMOTION_CAMERA, NAVIGATION_CAMERA, Camera
from vinl.world.boxes import Boxes
from vinl.world.floorplan import FloorPlan, assemble_floorplan
from vinl.world.free_space import FreeSpace

SHORT = EvaluationConfig(time_limit=0.2, min_distance=2.0)


@pytest.fixture(scope="module")
def cells(two_rooms: FloorPlan) -> FloorPlan:
    """The two rooms, their door walled up."""
    shut = two_rooms.walls + Boxes(np.array([[4.5, 3.0, 0.0, 0.1, 1.2, 0.0, 2.5]]))
    return assemble_floorplan("cells", "test", shut, two_rooms.furniture, two_rooms.inside, two_rooms.frame)


def test_separate_rooms_are_walked_one_by_one(cells: FloorPlan, standing: LocomotionPolicy) -> None:
    """Starts and goals lie in one room, and every episode says that floor was left out."""
    results = evaluate([cells], standing, "oracle", episodes=3, seeds=1, config=SHORT)
    for record in results.records:
        assert (record.start[0] < 4.5) == (record.goal[0] < 4.5)
        assert np.isfinite(record.geodesic_m) and "of the floor is left out" in record.note


def test_a_home_of_closets_is_refused(two_rooms: FloorPlan, standing: LocomotionPolicy) -> None:
    frame = two_rooms.frame
    bars = Boxes(np.array([[x, 3.0, 0.0, 0.1, 6.0, 0.0, 2.5] for x in np.arange(1.1, 9.0, 1.1)]))
    bars += Boxes(np.array([[4.5, y, 0.0, 9.0, 0.1, 0.0, 2.5] for y in np.arange(1.1, 6.0, 1.1)]))
    closets = assemble_floorplan(
        "closets", "closets.png", two_rooms.walls + bars, Boxes.empty(), two_rooms.inside, frame
    )
    with pytest.raises(InputError, match=r"closets.png.*too small for the robot"):
        evaluate([closets], standing, "oracle", episodes=1, seeds=1, config=SHORT)


@pytest.mark.parametrize(
    ("start", "goal", "words"),
    [
        ((2.0, 1.0), (2.0, 5.0), r"start \(2.00, 1.00\) lies inside furniture"),
        ((0.02, 3.0), (2.0, 5.0), "start .* lies inside a wall"),
        ((2.0, 5.0), (50.0, 5.0), "goal .* outside the floor plan"),
        ((2.0, 5.0), (0.2, 5.0), "goal .* is 0.1. m from a wall or furniture, the robot needs 0.22 m"),
        ((2.0, 5.0), (7.0, 5.0), r"no path leads from \(2.00, 5.00\) to \(7.00, 5.00\): they lie in rooms without"),
    ],
)
def test_routes_that_cannot_be_walked(cells: FloorPlan, start: tuple, goal: tuple, words: str) -> None:
    with pytest.raises(InputError, match=words):
        place_route(FreeSpace(cells), np.array(start), np.array(goal))


def test_routes_of_ones_own(two_rooms: FloorPlan, tmp_path: Path) -> None:
    file = tmp_path / "routes.yaml"
    file.write_text("two_rooms: [{start: [2.0, 5.0], goal: [7.0, 5.0]}, {start: [1.0, 3.0], goal: [2.0, 3.0]}]")
    routes = read_routes(file, [two_rooms])["two_rooms"]
    assert len(routes) == 2 and routes[0].straight_m == pytest.approx(5.0) and routes[0].geodesic_m > 5.5
    for text, words in (
        ("other: []", "'other' is none of the floor plans"),
        ("two_rooms: []", "two_rooms needs a list of pairs"),
        ("two_rooms: [{start: [1.0, 3.0]}]", r"pair 0: needs \{start"),
        ("two_rooms: [{start: [1.0, .nan], goal: [2.0, 3.0]}]", "outside the floor plan"),
        ("two_rooms: [{start: [a, 3.0], goal: [2.0, 3.0]}]", "in metres"),
    ):
        file.write_text(text)
        with pytest.raises(InputError, match=words):
            read_routes(file, [two_rooms])


def test_routes_on_the_command_line(capsys: pytest.CaptureFixture[str]) -> None:
    Path("routes.yaml").write_text(yaml.safe_dump({"harbour_flat": [{"start": [-99.0, 0.0], "goal": [1.0, 1.0]}]}))
    words = "--out a --floorplans harbour_flat --routes routes.yaml --loco rough --workers 1 --seeds 1"
    assert main(["eval", *words.split()]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1 and "pair 0: start (-99.00, 0.00) lies outside the floor plan" in error
    assert not Path("a").exists()


class Broken:
    """A locomotor of one's own whose answers make no sense."""

    camera: Camera | None = None

    def __init__(self, policy: LocomotionPolicy, answer: np.ndarray) -> None:
        self.card, self.answer = policy.card, answer

    def reset(self, which: Any) -> None: ...

    def act(self, observation: Any, depth: Any = None) -> np.ndarray:
        return self.answer


@pytest.mark.parametrize(
    ("answer", "words"),
    [(np.full((1, 12), np.nan), "not finite"), (np.zeros((1, 11)), r"must return \(1, 12\) actions, got \(1, 11\)")],
)
def test_locomotors_that_make_no_sense(
    two_rooms: FloorPlan, standing: LocomotionPolicy, answer: np.ndarray, words: str
) -> None:
    with pytest.raises(InputError, match=f"locomotor standing .*{words}"):
        evaluate([two_rooms], Broken(standing, answer), "oracle", episodes=1, seeds=1, config=SHORT)


def test_a_learned_navigator_that_turns_to_nan(two_rooms: FloorPlan, standing: LocomotionPolicy) -> None:
    network = TinyGuide()
    network.gain.data[:] = torch.nan
    camera = replace(NAVIGATION_CAMERA, height=8, width=12)
    guide = LearnedNavigator(DepthPolicy(network, navigation_card("guide", network.describe(), camera.describe())))
    with pytest.raises(InputError, match="LearnedNavigator returned numbers that are not finite"):
        evaluate([two_rooms], standing, guide, episodes=1, seeds=1, config=SHORT)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (
            {"name": "rear"},
            "walker sees through a camera 'rear' that the robot lacks; it carries: locomotion, navigation",
        ),
        ({"position": (-0.4, 0.0, 0.0)}, "walker sees through a camera at .* on the trunk"),
    ],
)
def test_a_camera_that_the_robot_lacks(two_rooms: FloorPlan, change: dict, words: str) -> None:
    camera = replace(LOCOMOTION_CAMERA, height=4, width=6, **change)
    network = TinyWalker()
    card = locomotion_card("walker", network.describe(), camera=camera.describe())
    with pytest.raises(InputError, match=words):
        evaluate([two_rooms], DepthPolicy(network, card), "oracle", episodes=1, seeds=1, config=SHORT)
