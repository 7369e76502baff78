"""The navigator's network: actions in range, memory that new episodes lose, a card that rebuilds it."""

import pytest
import torch

from vinl.policies.card import navigation_card
from vinl.policies.depth_policy import DepthPolicy
from vinl.policies.io import load_policy, save_policy
from vinl.policies.nav_actor import NavActor
from vinl.policies.networks import build_network
from vinl.robot.cameras import Camera

SMALL = {"height": 24, "width": 32, "visual": 16, "embedding": 4, "hidden": 8, "layers": 2}


@pytest.mark.parametrize("vision", ["resnet18", "cnn", "none"])
def test_actions_lie_in_range_and_a_sequence_is_its_steps(vision):
    torch.manual_seed(0)
    actor = NavActor(vision=vision, planes=16, **SMALL)
    depth, vector = torch.rand(5, 3, 24, 32), torch.randn(5, 3, 5)
    fresh = torch.zeros(5, 3, dtype=torch.bool)
    fresh[0], fresh[2, 1] = True, True
    whole, last = actor(depth, vector, actor.initial_state(3), fresh)
    assert whole.shape == (5, 3, 2) and whole.abs().max() <= 1.0
    state, steps = actor.initial_state(3), []
    for t in range(5):
        step, state = actor(depth[t : t + 1], vector[t : t + 1], state, fresh[t : t + 1])
        steps.append(step)
    assert torch.allclose(torch.cat(steps), whole, atol=1e-5)
    assert all(torch.allclose(a, b, atol=1e-5) for a, b in zip(last, state, strict=True))


def test_an_untrained_navigator_asks_for_the_middle_of_its_ranges():
    actor = NavActor(**SMALL, vision="cnn")
    action, _ = actor(torch.rand(1, 4, 24, 32), torch.randn(1, 4, 5), actor.initial_state(4), torch.ones(1, 4) > 0)
    assert action.abs().max() < 0.1


def test_defaults_are_the_papers_sizes():
    with torch.device("meta"):
        actor = NavActor()
    assert actor.memory.layers == 2 and actor.memory.hidden == 512 and actor.image == (48, 80)
    assert 8e6 < sum(p.numel() for p in actor.parameters()) < 12e6


def test_a_card_rebuilds_it(tmp_path):
    actor = NavActor(**SMALL, planes=16)
    camera = Camera("navigation", (0.35, 0.0, 0.0), 0.0, 1.5, 32, 24, 10.0)
    save_policy(tmp_path / "nav", actor, navigation_card("nav", actor.describe(), camera.describe()))
    policy = load_policy(tmp_path / "nav")
    assert isinstance(policy, DepthPolicy) and policy.camera == camera
    assert policy.network.describe() == actor.describe() == build_network(actor.describe()).describe()
    policy.reset(2)
    assert policy.act(torch.zeros(2, 5), torch.full((2, 24, 32), 3.0)).shape == (2, 2)
