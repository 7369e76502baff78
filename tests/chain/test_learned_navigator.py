"""Policies that see, in the chain: what they are given, what becomes of their answer, the same from any process."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
from tiny_networks import TinyGuide, TinyWalker

from vinl.benchmark.evaluate import evaluate
from vinl.chain.batching import find_safe_sizes
from vinl.chain.choose import load_navigator
from vinl.chain.config import EvaluationConfig
from vinl.chain.navigators.base import Task
from vinl.chain.navigators.learned import LearnedNavigator
from vinl.chain.navigators.recovery import RecoveringNavigator
from vinl.cli.app import main
from vinl.config.errors import InputError
from vinl.policies.card import locomotion_card, navigation_card
from vinl.policies.depth_policy import DepthPolicy
from vinl.policies.io import load_policy, save_policy
from vinl.policies.policy import LocomotionPolicy
from vinl.robot.cameras import LOCOMOTION_CAMERA, NAVIGATION_CAMERA
from vinl.world.floorplan import FloorPlan
from vinl.world.free_space import FreeSpace
from vinl.world.start_goal import sample_start_goals


def make_guide() -> DepthPolicy:
    network = TinyGuide()
    camera = replace(NAVIGATION_CAMERA, height=8, width=12)
    return DepthPolicy(network, navigation_card("guide", network.describe(), camera.describe()))


def make_walker() -> DepthPolicy:
    torch.manual_seed(1)
    network = TinyWalker()
    camera = replace(LOCOMOTION_CAMERA, height=4, width=6)
    return DepthPolicy(network, locomotion_card("walker", network.describe(), camera=camera.describe()))


def test_goal_and_last_action_in_velocities_out(two_rooms: FloorPlan) -> None:
    policy = make_guide()
    navigator = LearnedNavigator(policy)
    task = Task(FreeSpace(two_rooms), sample_start_goals(two_rooms, 1, np.random.default_rng(0), 2.0)[0])
    navigator.reset([task, task])
    goal = np.array([[10.0, 1.0, 0.0], [2.5, 0.0, 1.0]])
    observation = {"goal": goal, "depth": torch.full((2, 8, 12), 5.0), "pose": np.zeros((2, 3))}
    choice = navigator.act(observation)
    np.testing.assert_allclose(choice, [[0.8, 0.0], [0.0, np.pi / 3]], atol=1e-6)  # beyond the range: held to 60 deg/s
    navigator.act(observation)
    (depth, vector, fresh), (_, later, stale) = policy.network.seen  # type: ignore[misc]
    np.testing.assert_allclose(depth, 0.5)
    np.testing.assert_allclose(vector[0], [[2.0, 1, 0, 0, 0], [0.5, 0, 1, 0, 0]])
    np.testing.assert_allclose(later[0, :, 3:], [[0.6, 0.0], [-1.0, 1.0]])
    assert fresh.all() and not stale.any()


@pytest.mark.parametrize("recover", [True, False])
def test_a_robot_that_does_not_come_on_is_freed_and_the_policy_is_told(two_rooms: FloorPlan, recover: bool) -> None:
    policy = make_guide()
    learned = LearnedNavigator(policy)
    navigator = RecoveringNavigator(learned) if recover else learned
    task = Task(FreeSpace(two_rooms), sample_start_goals(two_rooms, 1, np.random.default_rng(0), 2.0)[0])
    navigator.reset([task, task])
    choices = []
    for step in range(11):
        # the first stands, and in the end has come back a little; the second walks
        poses = np.array([[-0.5 * (step == 10), 0.0, 0.0], [0.3 * step, 0.0, 0.0]])
        goal = np.array([[10.0, 1.0, 0.0], [10.0, 1.0, 0.0]])
        observation = {"goal": goal, "depth": torch.full((2, 8, 12), 5.0), "pose": poses}
        choices.append(navigator.act(observation))
    told = [policy.network.seen[step + 1][1][0, :, 3:] for step in (7, 9)]  # type: ignore[index]
    image = policy.network.seen[10][0].reshape(2, 8, 12)  # type: ignore[index]
    assert (image[0].min() < 0.05) == recover  # the nearer side of a post
    np.testing.assert_allclose(image[1], 0.5)
    if recover:
        np.testing.assert_allclose(choices[7], [[-0.3, 0.0], [0.8, 0.0]], atol=1e-6)
        np.testing.assert_allclose(told[0], [[-1.0, 0.0], [0.6, 0.0]], atol=1e-6)  # the nearest that there is
        np.testing.assert_allclose(choices[9], [[0.0, np.pi / 3], [0.8, 0.0]], atol=1e-6)
        np.testing.assert_allclose(told[1], [[-1.0, 1.0], [0.6, 0.0]], atol=1e-6)
    else:
        np.testing.assert_allclose(choices[7], [[0.8, 0.0], [0.8, 0.0]], atol=1e-6)


def test_scripted_navigator_walks_an_episode(two_rooms: FloorPlan) -> None:
    """The shipped locomotor, steered by a network that heads straight for the goal; images at 2 Hz."""
    config = EvaluationConfig(time_limit=30.0, min_distance=2.0, success_radius=1.0)
    policy = make_guide()
    find_safe_sizes(policy.network)  # tried once, before the walk
    policy.network.seen.clear()  # type: ignore[operator, union-attr]
    results = evaluate([two_rooms], "rough", LearnedNavigator(policy), episodes=1, seeds=1, config=config)
    record = results.records[0]
    assert record.success and record.distance_m > 0.9 * (record.straight_m - 1.0)
    assert results.policies["navigation"]["name"] == "guide"
    assert len(policy.network.seen) == int(np.ceil(record.time_s / 0.5))  # type: ignore[arg-type]
    depth = policy.network.seen[0][0]  # type: ignore[index]
    assert 0 < depth.min() < depth.max() <= 1


def test_same_numbers_from_two_processes(two_rooms: FloorPlan) -> None:
    config = EvaluationConfig(time_limit=0.7)
    one, two = (
        evaluate(
            [two_rooms], make_walker(), LearnedNavigator(make_guide()), episodes=2, seeds=2, obstacles="paper",
            config=config, workers=workers,
        )
        for workers in (1, 2)
    )  # fmt: skip
    assert one.records == two.records
    for a, b in zip(one.episodes, two.episodes, strict=True):
        np.testing.assert_array_equal(a.trace.path, b.trace.path)


def test_command_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    loco, nav = make_walker(), make_guide()
    save_policy("loco", loco.network, loco.card)
    save_policy("nav", nav.network, nav.card)
    options = "--floorplans harbour_flat --episodes 1 --seeds 1 --workers 1 --set time_limit=0.5 --out runs"
    assert main(["eval", *f"--loco ./loco --nav ./nav {options}".split()]) == 0
    policies = json.loads(Path("runs/results.json").read_text())["policies"]
    assert {name: row["name"] for name, row in policies.items()} == {"locomotion": "walker", "navigation": "guide"}
    capsys.readouterr()
    for given, words in (
        ("--loco ./nav", "guide is a navigation policy; give a locomotion policy"),
        ("--nav ./loco", "walker is a locomotion policy; a navigator"),
        ("--nav rough", "rough is a locomotion policy; a navigator"),
        ("--nav orcale", "unknown navigator 'orcale', did you mean 'oracle'"),
    ):
        assert main(["eval", *given.split(), *options.split()]) == 2
        error = capsys.readouterr().err
        assert error.startswith("error: ") and error.count("\n") == 1 and words in error


class Rambling:
    """A navigator of one's own whose answers make no sense."""

    camera = None

    def __init__(self, answer: np.ndarray) -> None:
        self.answer = answer

    def reset(self, episodes: object) -> None: ...

    def act(self, observation: object) -> np.ndarray:
        return self.answer


@pytest.mark.parametrize(
    ("answer", "words"),
    [(np.full((1, 2), np.nan), "not finite"), (np.zeros((1, 3)), r"shape \(1, 2\), got \(1, 3\)")],
)
def test_answers_that_make_no_sense(
    two_rooms: FloorPlan, standing: LocomotionPolicy, answer: np.ndarray, words: str
) -> None:
    with pytest.raises(InputError, match=f"navigator Rambling .*{words}"):
        evaluate([two_rooms], standing, Rambling(answer), episodes=1, seeds=1)  # type: ignore[arg-type]


def test_navigators_by_name(tmp_path: Path) -> None:
    policy = make_guide()
    folder = save_policy(tmp_path / "guide", policy.network, policy.card)
    navigator = load_navigator(folder, EvaluationConfig())
    assert isinstance(navigator, LearnedNavigator) and navigator.card.name == "guide"
    assert load_policy(folder).camera == navigator.camera


@pytest.mark.parametrize("previous", ["motion", "both", "step"])
def test_last_motion_instead_of_last_action(two_rooms: FloorPlan, previous: str) -> None:
    """What the card says it observes: how far the robot came, whatever it asked for."""
    network, camera = TinyGuide(), replace(NAVIGATION_CAMERA, height=8, width=12)
    network.observation_size = {"motion": 5, "both": 7, "step": 8}[previous]
    card = navigation_card("guide", network.describe(), camera.describe(), previous)
    navigator = LearnedNavigator(DepthPolicy(network, card))
    task = Task(FreeSpace(two_rooms), sample_start_goals(two_rooms, 1, np.random.default_rng(0), 2.0)[0])
    navigator.reset([task, task])
    for pose in ([[1.0, 2.0, 0.0], [0.0, 0.0, np.pi / 2]], [[1.0, 2.0, 0.0], [0.0, 0.4, np.pi / 2 + np.pi / 12]]):
        goal = np.array([[10.0, 1.0, 0.0], [2.5, 0.0, 1.0]])
        navigator.act({"goal": goal, "pose": np.array(pose), "depth": torch.full((2, 8, 12), 5.0)})
    (_, first, _), (_, later, _) = network.seen
    np.testing.assert_array_equal(first[0, :, 3:], 0.0)
    # the first stood, the second walked 0.8 m/s and turned by 30 deg/s
    if previous == "step":
        np.testing.assert_allclose(later[0, :, -3:], [[0.0, 0.0, 0.0], [0.4, 0.0, np.pi / 12]], atol=1e-6)
    else:
        forward = 0.4 * np.cos(np.pi / 24) / np.sinc(1 / 24) / 0.5
        np.testing.assert_allclose(later[0, :, -2:], [[-1.0, 0.0], [2 * forward - 1, 0.5]], atol=1e-6)
    if previous != "motion":
        np.testing.assert_allclose(later[0, :, 3:5], [[0.6, 0.0], [-1.0, 1.0]])
