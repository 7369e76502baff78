"""PPO for networks with memory: it learns what only memory solves, sees in the update what it saw when acting, goes on
after a save, and averages over processes."""

import pytest
import torch
from tensordict import TensorDict
from torch import nn
from two_processes import run_two

from vinl.config.errors import InputError
from vinl.nav.learning_config import NavPpoConfig
from vinl.nav.recurrent_model import RecurrentActorCritic, RecurrentStorage
from vinl.nav.recurrent_ppo import RecurrentPPO
from vinl.policies.depth_memory import DepthMemory
from vinl.policies.networks import NETWORKS, PolicyNetwork
from vinl.rl.learning_rate import DeviceRate
from vinl.rl.parallel import Peers, join_peers

STEPS, EPISODE = 8, 4


class ToyActor(PolicyNetwork):
    """One number in, one out, memory between."""

    observation_size = action_size = 1

    def __init__(self, image: bool = False) -> None:
        super().__init__()
        self.memory = DepthMemory("cnn" if image else "none", 16, 16, 1, 8, 16, 1)
        self.image, self.feature_size = self.memory.image, 16
        self.mean = nn.Linear(16, 1)

    def initial_state(self, n, device=None):
        return self.memory.initial_state(n, device)

    def look(self, depth, vector, state, fresh):
        return self.memory(depth, vector, state, fresh)

    def choose(self, feature):
        return torch.tanh(self.mean(feature))


NETWORKS.pop("ToyActor")


class CueTask:
    """A sign is shown in an episode's first step, as a number or as a bright image; later steps ask for it back."""

    def __init__(self, n, image=False):
        self.n, self.image = n, image
        self.clock = torch.arange(n) % EPISODE
        self.cue = torch.randint(0, 2, (n,)) * 2.0 - 1.0

    def observe(self):
        shown = torch.where(self.clock == 0, self.cue, 0.0)
        observation = {"vector": torch.zeros(self.n, 1) if self.image else shown[:, None]}
        if self.image:
            observation["depth"] = (0.5 + 0.5 * shown)[:, None, None].expand(-1, 16, 16).half()
        return TensorDict(observation, batch_size=[self.n])

    def step(self, action):
        reward = 1.0 - (action[:, 0] - 0.5 * self.cue).square()
        self.clock = (self.clock + 1) % EPISODE
        done = self.clock == 0
        self.cue = torch.where(done, torch.randint(0, 2, (self.n,)) * 2.0 - 1.0, self.cue)
        return self.observe(), reward, done, {"time_outs": torch.zeros(self.n)}


def build(n=64, image=False, image_type="float16", rate=3e-3, peers=None, **settings):
    model = RecurrentActorCritic(ToyActor(image))
    state = model.actor.initial_state(n)
    storage = RecurrentStorage(STEPS, n, model.actor.image, image_type, 1, 1, state, "cpu")
    return RecurrentPPO(model, storage, DeviceRate(rate), NavPpoConfig(**settings), peers)


def roll_out(algorithm, task, observation):
    total = 0.0
    with torch.inference_mode():
        for _ in range(STEPS):
            observation, reward, done, extras = task.step(algorithm.act(observation))
            algorithm.process_env_step(observation, reward, done, extras)
            total += float(reward.mean()) / STEPS
        algorithm.compute_returns(observation)
    return observation, total


def learn(algorithm, task, updates):
    observation, reward = task.observe(), 0.0
    for _ in range(updates):
        observation, reward = roll_out(algorithm, task, observation)
        losses = algorithm.update()
    return reward, losses


@pytest.mark.parametrize(("image", "image_type"), [(False, "float16"), (True, "uint8")])
def test_it_learns_what_only_memory_solves(image, image_type):
    torch.manual_seed(1)
    algorithm = build(image=image, image_type=image_type, entropy=0.0, gamma=0.5)
    reward, losses = learn(algorithm, CueTask(64, image), 40 if image else 60)
    # without memory the best that three of four steps can have is 0.75, less the spread of the actions
    assert reward > 0.9
    assert losses["kl"] >= 0.0 and losses["gradient_norm"] > 0.0


def test_the_update_sees_what_acting_saw():
    torch.manual_seed(2)
    algorithm, task = build(image=True, image_type="uint8", epochs=1, minibatches=1, rate=1e-5), CueTask(64, image=True)
    observation = task.observe()
    for _ in range(3):  # the second roll-out begins in the middle of episodes
        observation, _ = roll_out(algorithm, task, observation)
        losses = algorithm.update()
        # the divergence is measured before the step: memory at the start, cuts at new episodes and images are the same
        assert losses["kl"] < 1e-6 and losses["clipped"] == 0.0


def test_advantages_are_the_textbook_ones():
    st = build(n=4).storage
    torch.manual_seed(3)
    st.rewards.normal_(), st.values.normal_()
    st.done.copy_(torch.rand(STEPS, 4) < 0.3)
    last = torch.randn(4)
    st.estimate_advantages(last, 0.9, 0.8)
    for robot in range(4):
        expected = 0.0
        for t in reversed(range(STEPS)):
            on = 1.0 - float(st.done[t, robot])
            after = last[robot] if t == STEPS - 1 else st.values[t + 1, robot]
            expected = st.rewards[t, robot] + 0.9 * on * after - st.values[t, robot] + 0.9 * 0.8 * on * expected
            assert st.advantages[t, robot] == pytest.approx(float(expected), abs=1e-5)
            assert st.returns[t, robot] == pytest.approx(float(expected + st.values[t, robot]), abs=1e-5)


def test_time_outs_are_bootstrapped():
    algorithm, task = build(n=4, minibatches=1), CueTask(4)
    observation = task.observe()
    with torch.inference_mode():
        algorithm.act(observation)
        flags = torch.tensor([1.0, 0.0, 1.0, 0.0])
        algorithm.process_env_step(observation, torch.ones(4), flags.bool(), {"time_outs": flags})
    st = algorithm.storage
    assert torch.allclose(st.rewards[0], 1.0 + 0.99 * st.values[0] * flags)


def test_saved_and_loaded_it_learns_on_alike(tmp_path):
    torch.manual_seed(4)
    first, task = build(), CueTask(64)
    learn(first, task, 2)
    torch.save(first.save(), tmp_path / "a.pt")
    second = build()
    second.load(torch.load(tmp_path / "a.pt", weights_only=True))
    assert second.learning_rate == first.learning_rate
    state = torch.get_rng_state(), task.clock.clone(), task.cue.clone()
    learn(first, task, 2)
    torch.set_rng_state(state[0])
    task.clock, task.cue = state[1], state[2]
    learn(second, task, 2)
    pairs = zip(first.model.parameters(), second.model.parameters(), strict=True)
    assert all(torch.equal(a, b) for a, b in pairs)


def test_the_rate_follows_the_divergence_within_its_limits():
    rate = DeviceRate(1e-3, 5e-4, 2e-3, desired_kl=0.01, down=1.5, up=1.1)
    rate.steer(torch.tensor(0.03))
    assert rate.read() == pytest.approx(1e-3 / 1.5)
    for _ in range(5):
        rate.steer(torch.tensor(0.03))
    assert rate.read() == pytest.approx(5e-4)
    rate.steer(torch.tensor(0.01))
    assert rate.read() == pytest.approx(5e-4)
    for _ in range(30):
        rate.steer(torch.tensor(0.001))
    assert rate.read() == pytest.approx(2e-3)
    rate.limit(1e-4, 1e-4)
    assert rate.read() == pytest.approx(1e-4)


def test_robots_that_do_not_divide_are_refused():
    with pytest.raises(InputError, match=r"multiple of ppo\.minibatches"):
        build(n=6, minibatches=4)


def _train_in_process(peers):
    torch.manual_seed(peers.rank)  # other weights and other episodes in each process
    algorithm = build(n=8, minibatches=2, peers=peers)
    before = [p.detach().clone() for p in algorithm.model.parameters()]
    learn(algorithm, CueTask(8), 2)
    assert peers.any(peers.rank == 1) and not peers.any(False)
    after = [p.detach() for p in algorithm.model.parameters()]
    return {"before": before, "after": after, "rate": algorithm.learning_rate}


def test_two_processes_keep_the_same_weights(tmp_path):
    one, two = run_two(_train_in_process, tmp_path)
    assert one["rate"] == two["rate"]
    for key in ("before", "after"):
        assert all(torch.equal(a, b) for a, b in zip(one[key], two[key], strict=True))
    assert not torch.equal(one["before"][0], one["after"][0])


def test_one_process_has_no_peers():
    peers, device = join_peers("cpu")
    assert (peers.count, device) == (1, "cpu") and isinstance(peers, Peers) and not peers.any(False)
