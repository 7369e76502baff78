"""An answer depends on its own robot alone: not on how many others are asked, nor on their order."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from vinl.benchmark import protocol
from vinl.benchmark.evaluate import evaluate
from vinl.chain.batching import BatchedPolicy, batch_policy, is_steady
from vinl.chain.config import EvaluationConfig
from vinl.chain.navigators.learned import LearnedNavigator
from vinl.gait.observation import SENSED_TABLE
from vinl.policies.card import locomotion_card, navigation_card
from vinl.policies.depth_policy import DepthPolicy
from vinl.policies.io import load_policy
from vinl.policies.nav_actor import NavActor
from vinl.policies.policy import LocomotionPolicy
from vinl.policies.stepping_actor import SteppingActor
from vinl.robot.cameras import LOCOMOTION_CAMERA, NAVIGATION_CAMERA
from vinl.world.floorplan import FloorPlan

N, STEPS = 21, 4


@pytest.fixture(scope="module")
def student() -> DepthPolicy:
    """The student's network with random weights."""
    torch.manual_seed(0)
    camera = replace(LOCOMOTION_CAMERA, missing="plane").describe()
    network = SteppingActor(camera)
    return DepthPolicy(network, locomotion_card("student", network.describe(), table=SENSED_TABLE, camera=camera))


@pytest.fixture(scope="module")
def guide() -> DepthPolicy:
    """The navigator's network with random weights, smaller than the shipped one."""
    torch.manual_seed(0)
    network = NavActor(height=24, width=32, visual=64, hidden=64)
    network.mean.weight.data *= 100
    camera = replace(NAVIGATION_CAMERA, height=24, width=32)
    return DepthPolicy(network, navigation_card("guide", network.describe(), camera.describe()))


def ask(policy: DepthPolicy | LocomotionPolicy, groups: list[np.ndarray]) -> np.ndarray:
    """The answers of some steps, robots asked group by group, each group by itself."""
    rng = np.random.default_rng(0)
    vectors = rng.normal(size=(STEPS, N, policy.card.observation_size)).astype(np.float32)
    shape = (1, 1) if policy.camera is None else (policy.camera.height, policy.camera.width)
    images = torch.as_tensor(rng.uniform(0, 2, (STEPS, N, *shape)), dtype=torch.float32)
    ages = rng.uniform(0, 0.06, (STEPS, N))
    found = np.zeros((STEPS, N, policy.network.action_size), np.float32)
    for group in groups:
        batched = BatchedPolicy(policy)
        batched.reset(len(group))
        for step in range(STEPS):
            depth = None if policy.camera is None else images[step, group]
            found[step, group] = batched.act(vectors[step, group], depth, ages[step, group])
    return found


@pytest.mark.parametrize("name", ["student", "guide", "rough"])
def test_answers_do_not_depend_on_company(name: str, request: pytest.FixtureRequest) -> None:
    policy = load_policy("rough") if name == "rough" else request.getfixturevalue(name)
    order = np.random.default_rng(1).permutation(N)
    together = ask(policy, [np.arange(N)])
    assert np.ptp(together[-1], axis=0).min() > 0
    for groups in ([order], [order[:3], order[3:]], np.array_split(order, 6), [np.array([k]) for k in range(N)]):
        np.testing.assert_array_equal(ask(policy, list(groups)), together)


def test_batches_say_what_the_policy_says(student: DepthPolicy) -> None:
    rng = np.random.default_rng(0)
    batched = BatchedPolicy(student)
    student.reset(5)
    batched.reset(5)
    for step in range(6):
        vector = rng.normal(size=(5, 45)).astype(np.float32)
        depth = torch.as_tensor(rng.uniform(0, 2, (5, 56, 96)), dtype=torch.float32)
        age = rng.uniform(0, 0.06, 5)
        np.testing.assert_allclose(batched.act(vector, depth, age), student.act(vector, depth, age), atol=1e-5)
        if step == 2:
            mask = np.array([True, False, False, True, False])
            student.reset(mask)
            batched.reset(mask)


def test_those_not_asked_keep_their_memory_and_answer(student: DepthPolicy) -> None:
    rng = np.random.default_rng(0)
    vector, depth = rng.normal(size=(3, 45)).astype(np.float32), torch.zeros(3, 56, 96)
    alone, some = BatchedPolicy(student), BatchedPolicy(student)
    for policy in (alone, some):
        policy.reset(3)
    first = some.act(vector, depth)
    some.rows = [1]
    second = some.act(vector, depth)
    np.testing.assert_array_equal(second[[0, 2]], first[[0, 2]])
    alone.act(vector, depth)
    expected = alone.act(vector, depth)
    np.testing.assert_array_equal(second[1], expected[1])
    some.rows = [0, 2]
    np.testing.assert_array_equal(some.act(vector, depth), expected)


@pytest.mark.slow
def test_episodes_do_not_depend_on_company(
    two_rooms: FloorPlan, student: DepthPolicy, guide: DepthPolicy, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The whole chain, both policies with eyes, in pieces of work of several sizes."""
    config = EvaluationConfig(time_limit=1.2)
    runs = []
    for size in (24, 2, 1):
        monkeypatch.setattr(protocol, "LARGEST", size)
        monkeypatch.setattr(protocol, "_PIECES", 1)
        results = evaluate(
            [two_rooms], student, LearnedNavigator(guide), episodes=3, seeds=1, obstacles="paper", config=config
        )
        runs.append(results)
    for other in runs[1:]:
        assert other.records == runs[0].records
        for a, b in zip(other.episodes, runs[0].episodes, strict=True):
            np.testing.assert_array_equal(a.trace.path, b.trace.path)


def test_a_policy_of_ones_own_is_left_as_it_is(student: DepthPolicy) -> None:
    class Own(DepthPolicy):
        pass

    own = Own(student.network, student.card)
    assert batch_policy(own) is own and not is_steady(own)
    assert isinstance(batch_policy(student), BatchedPolicy)
