"""Functions of one's own in the chain: what they are given, what becomes of their answers."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import torch

import vinl
from vinl.config.errors import InputError

PLAN = "harbour_flat"
SHORT = vinl.EvaluationConfig(time_limit=1.0, min_distance=2.0)


class Counting:
    """Remembers how often it was asked since it was told to forget."""

    def __init__(self) -> None:
        self.count, self.seen = -1, []

    def reset(self, which: int) -> None:
        self.count, self.robots = 0, which

    def __call__(self, observation: dict) -> np.ndarray:
        self.count += 1
        self.seen.append({name: np.asarray(values).copy() for name, values in observation.items()})
        return np.tile([0.5, 0.1], (len(observation["goal"]), 1))


def test_navigator_sees_and_remembers() -> None:
    decide = Counting()
    camera = replace(vinl.NAVIGATION_CAMERA, width=20, height=12)
    plan = vinl.load_floorplan(PLAN)
    navigator = vinl.as_navigator(decide, camera)
    results = vinl.evaluate([plan], "rough", navigator, 2, 1, config=SHORT)
    assert results.policies["navigation"] == {"name": "Counting"}
    assert decide.count == 2 and decide.robots == 2
    first, second = decide.seen
    assert first["depth"].shape == (2, 12, 20) and first["goal"].shape == first["pose"].shape == (2, 3)
    assert not first["previous_action"].any()
    np.testing.assert_array_equal(second["previous_action"], [[0.5, 0.1]] * 2)


def test_function_around_a_policy_walks_as_the_policy() -> None:
    walker = vinl.load_policy("loco")

    class Same:
        def reset(self, which: Any) -> None:
            walker.reset(which)

        def __call__(self, observation: np.ndarray, depth: torch.Tensor) -> torch.Tensor:
            assert observation.dtype == np.float32 and observation.shape == (1, 48)
            return torch.as_tensor(walker.act(observation[:, 3:], depth))  # it measures no velocity

    own = vinl.walk(PLAN, vinl.as_locomotor(Same(), walker.camera), config=SHORT).record
    shipped = vinl.walk(PLAN, walker, config=SHORT).record
    assert own.distance_m == pytest.approx(shipped.distance_m, abs=0.02)  # the last bits of a network vary


def test_locomotor_with_a_camera_and_gains_of_its_own() -> None:
    camera = replace(vinl.LOCOMOTION_CAMERA, width=8, height=6)

    def hold(observation: np.ndarray, depth: torch.Tensor) -> np.ndarray:
        assert observation.shape == (1, 48) and depth.shape == (1, 6, 8) and depth.max() > depth.min()
        return np.zeros((1, 12))

    policy = vinl.as_locomotor(hold, camera, name="holding", kp=60.0)
    walk = vinl.walk(PLAN, policy, config=SHORT)
    assert walk.record.distance_m < 0.1 and not walk.record.fell
    assert policy.card.name == "holding" and policy.card.action["kp"] == 60.0 and policy.card.observation_size == 48


@pytest.mark.parametrize(
    ("answer", "words"), [(np.zeros((1, 3)), r"shape \(1, 12\), got \(1, 3\)"), (np.full((1, 12), np.nan), "finite")]
)
def test_answers_of_a_locomotor_that_make_no_sense(answer: np.ndarray, words: str) -> None:
    with pytest.raises(InputError, match=f"locomotor mine .*{words}"):
        vinl.walk(PLAN, vinl.as_locomotor(lambda _: answer, name="mine"), config=SHORT)


def test_answer_of_a_navigator_that_makes_no_sense() -> None:
    with pytest.raises(InputError, match=r"navigator lost .*finite"):
        vinl.walk(PLAN, "rough", vinl.as_navigator(lambda _: [[np.nan, 0.0]], name="lost"), config=SHORT)
