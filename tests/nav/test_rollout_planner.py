"""In a roll-out the grids go on with every step, and the policy learns from what it saw when it acted."""

import pytest
import torch
from tensordict import TensorDict

from vinl.nav import recurrent_ppo
from vinl.nav.learning_config import NavPpoConfig
from vinl.nav.recurrent_model import RecurrentActorCritic, RecurrentStorage
from vinl.nav.recurrent_ppo import RecurrentPPO
from vinl.nav.rollout_planner import RolloutPlanner
from vinl.policies.nav_actor import NavActor
from vinl.rl.learning_rate import DeviceRate
from vinl.robot.cameras import NAVIGATION_CAMERA

N, STEPS, HEIGHT, WIDTH = 4, 6, 16, 24
GRID = {
    "camera": NAVIGATION_CAMERA.describe() | {"height": HEIGHT, "width": WIDTH},
    "forward_speed": [-0.3, 0.8],
}


@pytest.fixture
def actor():
    torch.manual_seed(0)
    return NavActor("cnn", HEIGHT, WIDTH, 8, 8, 16, 1, previous=5, grid=GRID)


def draw(steps=STEPS):
    """Depth, vectors and beginnings of robots that move."""
    vector = torch.randn(steps, N, 8)
    vector[..., 5:] = torch.tensor([0.3, 0.02, 0.1])
    fresh = torch.zeros(steps, N, dtype=torch.bool)
    fresh[0], fresh[3, 1] = True, True
    return torch.rand(steps, N, HEIGHT, WIDTH) * 0.6, vector, fresh


def test_grids_go_on_only_when_told(actor):
    depth, vector, fresh = draw()
    planner, grid = RolloutPlanner(actor, N, torch.device("cpu"), False), actor.initial_grid(N)
    for k in range(STEPS):
        expected, grid = actor.plan(depth[k], vector[k], grid, fresh[k])
        for _ in range(2):  # asked twice, it answers the same
            torch.testing.assert_close(planner.plan(depth[k], vector[k], fresh[k]), expected)
        planner.go_on()
        for kept, now in zip(planner.grid, grid, strict=True):
            torch.testing.assert_close(kept, now)


def algorithm(actor):
    storage = RecurrentStorage(
        STEPS, N, (HEIGHT, WIDTH), "float16", actor.input_size, 2, actor.memory.initial_state(N), "cpu"
    )
    config = NavPpoConfig(steps=STEPS, epochs=1, minibatches=2)
    return RecurrentPPO(RecurrentActorCritic(actor), storage, DeviceRate(1e-3), config)


def test_without_triton_nothing_is_compiled(monkeypatch, capsys):
    monkeypatch.setattr(recurrent_ppo, "find_spec", {"triton": None}.__getitem__)
    assert not recurrent_ppo._has_triton()
    assert capsys.readouterr().err.startswith("warning: no Triton; nothing is compiled")
    monkeypatch.setattr(recurrent_ppo, "find_spec", {"triton": "here"}.__getitem__)
    assert recurrent_ppo._has_triton() and not capsys.readouterr().err


def test_a_run_goes_on_where_convolutions_lie_otherwise(actor):
    first = algorithm(actor)
    first.model.to(memory_format=torch.channels_last)  # as where norms have a kernel
    depth, vector, fresh = draw(STEPS + 1)

    def learn(one):
        torch.manual_seed(1)
        with torch.no_grad():
            for k in range(STEPS):
                one.act(TensorDict({"depth": depth[k], "vector": vector[k]}, [N]))
                one.process_env_step(TensorDict({}, [N]), torch.rand(N), fresh[k + 1], {})
            one.compute_returns(TensorDict({"depth": depth[STEPS], "vector": vector[STEPS]}, [N]))
        one.update()

    learn(first)
    second = algorithm(NavActor(**actor.arguments))
    second.load(first.save())
    for one in (first, second):
        learn(one)
    torch.testing.assert_close(second.model.state_dict(), first.model.state_dict(), rtol=1e-4, atol=1e-6)


def test_the_policy_acts_on_what_the_whole_network_would_see_and_goes_on_after_a_save(actor):
    ppo = algorithm(actor)
    depth, vector, fresh = draw(STEPS + 1)
    with torch.no_grad():
        for k in range(STEPS):
            ppo.act(TensorDict({"depth": depth[k], "vector": vector[k]}, [N]))
            ppo.process_env_step(TensorDict({}, [N]), torch.zeros(N), fresh[k + 1], {})
        seen, _ = actor(depth.half().float()[:STEPS], vector[:STEPS], actor.initial_state(N), fresh[:STEPS])
    torch.testing.assert_close(ppo.storage.means, seen)
    last = TensorDict({"depth": depth[STEPS], "vector": vector[STEPS]}, [N])
    ppo.compute_returns(last)
    ppo.update()
    other = algorithm(NavActor(**actor.arguments))
    other.load(ppo.save())
    with torch.no_grad():
        for one in (ppo, other):
            one.act(last)
    torch.testing.assert_close(other.storage.vector[0], ppo.storage.vector[0])
