"""Policies that see: memory by rows, the camera of the card, and what does not fit."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
from torch import Tensor, nn

from vinl.chain.navigators.learned import LearnedNavigator
from vinl.config.errors import InputError
from vinl.gait.observation import SENSED_TABLE
from vinl.policies.card import PolicyCard, locomotion_card, navigation_card
from vinl.policies.depth_policy import DepthPolicy
from vinl.policies.io import load_policy, save_policy
from vinl.policies.networks import PolicyNetwork, StepActor
from vinl.policies.policy import LocomotionPolicy
from vinl.policies.stepping_actor import SteppingActor
from vinl.robot.cameras import LOCOMOTION_CAMERA

CAMERA = replace(LOCOMOTION_CAMERA, width=6, height=4)


class CountingEye(PolicyNetwork):
    """Its actions are: mean of the image it got, steps since the episode began, first number observed."""

    def __init__(self, height: int = 4, width: int = 6, inputs: int = 48, actions: int = 12) -> None:
        super().__init__()
        self.arguments = {"height": height, "width": width, "inputs": inputs, "actions": actions}
        self.image: tuple[int, int] | None = (height, width)
        self.observation_size, self.action_size = inputs, actions
        self.weight = nn.Parameter(torch.ones(actions))

    def initial_state(self, n: int, device: object = None) -> tuple[Tensor, ...]:
        return (torch.full((1, n, 1), 7.0, device=device),)  # type: ignore[arg-type]

    def forward(
        self, depth: Tensor, vector: Tensor, state: tuple[Tensor, ...], fresh: Tensor
    ) -> tuple[Tensor, tuple[Tensor, ...]]:
        assert depth.shape[:2] == vector.shape[:2] == fresh.shape
        count = torch.where(fresh[0][None, :, None], 0.0, state[0]) + 1.0
        told = torch.cat([depth[0].mean((1, 2))[:, None], count[0], vector[0, :, :1]], -1)
        rest = torch.zeros(len(told), self.action_size - told.shape[1]) if self.action_size > 3 else told[:, :0]
        return torch.cat([told[:, : self.action_size], rest], -1)[None] * self.weight, (count,)


@pytest.fixture
def card() -> PolicyCard:
    return locomotion_card("eye", CountingEye().describe(), camera=CAMERA.describe())


def observe(n: int) -> tuple[np.ndarray, np.ndarray]:
    return np.arange(n * 48, dtype=np.float64).reshape(n, 48), np.full((n, 4, 6), 0.5, np.float32)


def test_camera_is_rebuilt_and_normalises(card: PolicyCard) -> None:
    policy = DepthPolicy(CountingEye(), card)
    assert policy.camera == CAMERA
    action = policy.act(*observe(3))
    assert action.dtype == np.float32 and action.shape == (3, 12)
    np.testing.assert_allclose(action[:, 0], 0.5 / CAMERA.far)
    np.testing.assert_allclose(action[:, 2], [0, 48, 96])
    numbers, depth = observe(3)
    again = DepthPolicy(CountingEye(), card).act(torch.from_numpy(numbers), torch.from_numpy(depth))
    assert isinstance(again, Tensor) and again.dtype == torch.float64
    np.testing.assert_allclose(action, again.numpy())


def test_only_the_rows_that_start_anew_forget(card: PolicyCard) -> None:
    policy = DepthPolicy(CountingEye(), card)
    policy.reset(3)
    counts = [policy.act(*observe(3))[:, 1].tolist()]
    counts.append(policy.act(*observe(3))[:, 1].tolist())
    policy.reset(np.array([False, True, False]))
    policy.reset(torch.tensor([True, False, False]))
    counts.append(policy.act(*observe(3))[:, 1].tolist())
    counts.append(policy.act(*observe(3))[:, 1].tolist())
    assert counts == [[1, 1, 1], [2, 2, 2], [1, 1, 3], [2, 2, 4]]
    with pytest.raises(ValueError, match=r"eye remembers 3 robots, got 2; call reset\(2\) first"):
        policy.act(*observe(2))
    with pytest.raises(ValueError, match="the mask has 2"):
        policy.reset(np.array([True, False]))
    policy.reset(2)
    assert policy.act(*observe(2))[:, 1].tolist() == [1, 1]


def test_wrong_shapes_are_named(card: PolicyCard) -> None:
    policy = DepthPolicy(CountingEye(), card)
    numbers, depth = observe(2)
    with pytest.raises(ValueError, match=r"eye observes \(n, 48\), got \(2, 47\)"):
        policy.act(numbers[:, :47], depth)
    with pytest.raises(ValueError, match=r"eye sees depth \(2, 4, 6\), got None"):
        policy.act(numbers)
    with pytest.raises(ValueError, match=r"eye sees depth \(2, 4, 6\), got \(2, 6, 4\)"):
        policy.act(numbers, depth.transpose(0, 2, 1))


def test_it_comes_back_from_its_folder(card: PolicyCard, tmp_path: Path) -> None:
    policy = load_policy(save_policy(tmp_path / "eye", CountingEye(), card))
    assert isinstance(policy, DepthPolicy)
    np.testing.assert_array_equal(policy.act(*observe(2)), DepthPolicy(CountingEye(), card).act(*observe(2)))
    guide = CountingEye(inputs=5, actions=2)
    folder = save_policy(tmp_path / "guide", guide, navigation_card("guide", guide.describe(), CAMERA.describe()))
    policy = load_policy(folder)
    assert policy.card.kind == "navigation" and policy.camera == CAMERA
    assert LearnedNavigator(policy).camera == CAMERA


def test_a_student_acts_alike_when_it_comes_back(tmp_path: Path) -> None:
    torch.manual_seed(0)
    camera = replace(LOCOMOTION_CAMERA, width=32, height=18, missing="plane").describe()
    student = SteppingActor(camera, hidden=8, layers=1, actor=(16,))
    card = locomotion_card("student", student.describe(), table=SENSED_TABLE, camera=camera)
    back = load_policy(save_policy(tmp_path / "student", student, card))
    seen = np.linspace(-1, 1, 90).reshape(2, 45), np.full((2, 18, 32), 0.5, np.float32)
    np.testing.assert_array_equal(back.act(*seen), DepthPolicy(student, card).act(*seen))


def test_cards_that_do_not_fit(card: PolicyCard, tmp_path: Path) -> None:
    def refused(network: PolicyNetwork, card: PolicyCard, pattern: str) -> None:
        folder = save_policy(tmp_path / "eye", network, card)
        with pytest.raises(InputError, match=pattern) as caught:
            load_policy(folder)
        assert "\n" not in str(caught.value)

    small = replace(CAMERA, width=8).describe()
    refused(CountingEye(), replace(card, camera=small), "the card is 8 x 4 pixels, the network takes 6 x 4")
    refused(CountingEye(), replace(card, camera=None), "sees 6 x 4 pixels, the card has no camera")
    refused(CountingEye(), replace(card, camera=small | {"hfov": 9.0}), "policy eye, camera: .*hfov")
    refused(CountingEye(), replace(card, camera=small | {"zoom": 2}), "unknown key 'zoom'")
    refused(CountingEye(), replace(card, camera={"name": "x"}), "position is missing")
    refused(CountingEye(), replace(card, kind="navigation"), r"navigation policy, but its network CountingEye \(12")
    two = CountingEye(actions=2)
    refused(two, replace(card, network=two.describe()), r"CountingEye \(2 actions\).*\(12 actions\)")


def test_a_locomotor_is_no_navigator() -> None:
    network = StepActor(actor=(8,))
    with pytest.raises(InputError, match="legs is a locomotion policy; a navigator"):
        LearnedNavigator(LocomotionPolicy(network, locomotion_card("legs", network.describe(), gait={})))
