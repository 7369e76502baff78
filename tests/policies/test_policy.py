"""The policy object: numpy and torch alike, batched, the paper's sizes."""

import numpy as np
import pytest
import torch

from vinl.policies.card import locomotion_card
from vinl.policies.networks import StepActor, build_network
from vinl.policies.policy import LocomotionPolicy


@pytest.fixture
def policy() -> LocomotionPolicy:
    network = StepActor()
    return LocomotionPolicy(network, locomotion_card("x", network.describe(), gait={}))


def test_paper_sizes(policy: LocomotionPolicy):
    shapes = {name: tuple(p.shape) for name, p in policy.network.named_parameters() if p.ndim == 2}
    assert list(shapes.values()) == [(512, 111), (256, 512), (128, 256), (12, 128)]
    assert {name.split(".")[0] for name in shapes} == {"actor"}


def test_numpy_and_torch_agree(policy: LocomotionPolicy):
    observation = np.random.default_rng(0).normal(size=(6, 111))
    action = policy.act(observation)
    assert action.dtype == np.float32 and action.shape == (6, 12)
    np.testing.assert_allclose(action, policy.act(torch.from_numpy(observation)).numpy(), rtol=1e-6)
    np.testing.assert_array_equal(action, policy.act(observation))
    policy.reset(6)
    policy.reset(np.array([True, False]))
    np.testing.assert_array_equal(action, policy.act(observation))


def test_action_can_be_written_to_and_carries_no_gradient(policy: LocomotionPolicy):
    action = policy.act(torch.zeros(2, 111, requires_grad=True))
    action += 1
    assert not action.requires_grad


def test_no_robot_is_no_problem(policy: LocomotionPolicy):
    assert policy.act(np.zeros((0, 111))).shape == (0, 12)


@pytest.mark.parametrize("shape", [(3, 48), (3, 112)])
def test_wrong_size_is_named(policy: LocomotionPolicy, shape: tuple[int, int]):
    with pytest.raises(ValueError, match=r"x observes \(n, 111\), got \(3, "):
        policy.act(np.zeros(shape))


def test_description_rebuilds_the_network():
    network = StepActor(actor=(16, 8))
    again = build_network(network.describe())
    assert {k: v.shape for k, v in again.state_dict().items()} == {k: v.shape for k, v in network.state_dict().items()}


def test_policies_and_cards_say_what_they_are_in_a_line(policy: LocomotionPolicy):
    assert max(len(repr(policy)), len(repr(policy.card))) < 100
