"""The network with eyes and memory: sequences equal single steps, episodes begin without a past, all sizes build."""

import pytest
import torch

from vinl.config.errors import InputError
from vinl.policies.depth_memory import DepthMemory
from vinl.policies.networks import build_network


@pytest.fixture(autouse=True)
def seeded():
    torch.manual_seed(0)


def small(vision="cnn", memory="lstm", height=18, width=32) -> DepthMemory:
    return DepthMemory(vision, height, width, vector=5, visual=8, hidden=16, layers=2, memory=memory, planes=16)


@pytest.mark.parametrize("vision", ["cnn", "resnet18", "none"])
@pytest.mark.parametrize("memory", ["lstm", "mlp"])
def test_a_sequence_equals_its_steps_one_by_one(vision, memory):
    network = small(vision, memory)
    depth, vector, fresh = torch.rand(6, 3, 18, 32), torch.randn(6, 3, 5), torch.zeros(6, 3, dtype=torch.bool)
    fresh[2, 0] = fresh[0, 1] = fresh[5, 2] = fresh[3, 0] = True
    state = tuple(torch.randn(2, 3, 16) for _ in network.initial_state(3))
    whole, last = network(depth, vector, state, fresh)
    assert whole.shape == (6, 3, 16) and whole.dtype == torch.float32
    steps, now = [], state
    for k in range(6):
        feature, now = network(depth[k : k + 1], vector[k : k + 1], now, fresh[k : k + 1])
        steps.append(feature[0])
    assert torch.allclose(torch.stack(steps), whole, atol=1e-5)
    assert all(torch.allclose(a, b, atol=1e-5) for a, b in zip(now, last, strict=True))
    assert len(network.initial_state(3)) == (2 if memory == "lstm" else 0)


def test_nothing_is_remembered_across_the_start_of_an_episode():
    network = small("none")
    vector, fresh = torch.randn(4, 2, 5), torch.zeros(4, 2, dtype=torch.bool)
    fresh[2, 0] = True
    past = vector.clone().requires_grad_()
    features, _ = network(None, past, network.initial_state(2), fresh)
    features[3].sum().backward()
    assert past.grad is not None
    assert not past.grad[:2, 0].any() and past.grad[2:, 0].any(1).all() and past.grad[:, 1].any(1).all()


@pytest.mark.parametrize(
    ("vision", "height", "width"), [("cnn", 36, 64), ("cnn", 60, 106), ("cnn", 90, 160), ("resnet18", 48, 80)]
)
def test_sizes_in_use(vision, height, width):
    network = DepthMemory(vision, height, width, 48, 32, 64, 2)
    features, _ = network(
        torch.rand(1, 2, height, width).half(),
        torch.randn(1, 2, 48),
        network.initial_state(2),
        torch.ones(1, 2).bool(),
    )
    assert features.shape == (1, 2, 64) and features.isfinite().all()


def test_the_papers_cnn_at_the_papers_size():
    with torch.device("meta"):
        network = DepthMemory("cnn", 180, 320, 48, 32, 64, 2)
    assert network.vision is not None
    assert network.vision.layers[-2].in_features == 21_888  # type: ignore[union-attr]


def test_autocast_reaches_the_images_only():
    network = small("resnet18")
    arguments = torch.rand(2, 3, 18, 32), torch.randn(2, 3, 5), network.initial_state(3), torch.zeros(2, 3).bool()
    with torch.autocast("cpu", torch.bfloat16):
        features, state = network(*arguments)
        features.sum().backward()
    assert features.dtype == state[1].dtype == torch.float32
    exact, _ = network(*arguments)
    assert torch.allclose(features, exact, atol=0.05)


def test_unknown_parts_are_refused():
    with pytest.raises(ValueError, match="vision"):
        small("eye")
    with pytest.raises(ValueError, match="memory"):
        small("cnn", "gru")


def test_the_navigator_is_rebuilt_from_its_description():
    network = build_network({"class": "NavActor", "vision": "none", "hidden": 8})
    again = build_network(network.describe())
    again.load_state_dict(network.state_dict())
    vector, fresh = torch.randn(3, 2, 5), torch.zeros(3, 2).bool()
    action, state = again(None, vector, again.initial_state(2), fresh)
    assert action.shape == (3, 2, 2) and state[0].shape == (2, 2, 8) and again.image is None
    for wrong in ({"vision": "eye"}, {"hidden": "wide"}, {"hidden": 0}):
        with pytest.raises(InputError):
            build_network({"class": "NavActor", **wrong})
