"""The update without waits is rsl-rl's: weights, learning rate and losses, and either loads the other's state. Two
processes learn what one learns."""

import contextlib
import copy
import io

import pytest
import torch
from rsl_rl.algorithms import PPO
from rsl_rl.env import VecEnv
from rsl_rl.modules.distribution import GaussianDistribution
from tensordict import TensorDict
from two_processes import run_two

from vinl.loco.fast_ppo import FastPPO
from vinl.loco.models import UncheckedGaussian

N, STEPS, SIZE, ACTIONS = 16, 6, 5, 3


class NoiseEnv(VecEnv):
    """Observations are noise, rewards prefer small actions. ``robots``: which of all N are here."""

    def __init__(self, robots=slice(None)):
        self.num_envs, self.num_actions, self.device, self.cfg = len(range(N)[robots]), ACTIONS, "cpu", {}
        self.chance, self.robots = torch.Generator().manual_seed(5), robots

    def get_observations(self):
        seen = torch.randn(N, SIZE, generator=self.chance)[self.robots]
        return TensorDict({"policy": seen, "critic": seen + 1.0}, batch_size=[self.num_envs])

    def step(self, actions):
        reward = -actions.square().sum(1) + torch.randn(N, generator=self.chance)[self.robots]
        done = torch.rand(N, generator=self.chance)[self.robots] < 0.2
        return self.get_observations(), reward, done.long(), {"time_outs": (done & (reward > 0)).float()}


def build(name, env, seed=1, **more):
    settings = {
        "num_steps_per_env": STEPS,
        "multi_gpu": None,
        "obs_groups": {"actor": ["policy"], "critic": ["critic"]},
        "actor": {
            "class_name": "MLPModel",
            "hidden_dims": [16, 16],
            "activation": "elu",
            "distribution_cfg": {"class_name": "GaussianDistribution", "init_std": 1.0},
        },
        "critic": {"class_name": "MLPModel", "hidden_dims": [16, 16], "activation": "elu"},
        "algorithm": {"class_name": name, "num_learning_epochs": 3, "num_mini_batches": 4, **more},
    }
    torch.manual_seed(seed)
    with contextlib.redirect_stdout(io.StringIO()):
        return PPO.construct_algorithm(env.get_observations(), env, settings, "cpu")


def learn(algorithm, env, updates):
    torch.manual_seed(2)
    observation, rows = env.get_observations(), []
    for _ in range(updates):
        with torch.inference_mode():
            for _ in range(STEPS):
                observation, reward, done, extras = env.step(algorithm.act(observation))
                algorithm.process_env_step(observation, reward, done, extras)
            algorithm.compute_returns(observation)
        rows.append({**algorithm.update(), "rate": float(algorithm.learning_rate)})
    return rows


def assert_same_weights(a, b):
    for one, two in zip(
        [*a.actor.parameters(), *a.critic.parameters()], [*b.actor.parameters(), *b.critic.parameters()], strict=True
    ):
        assert torch.allclose(one, two, atol=2e-5, rtol=1e-4)


@pytest.mark.parametrize(
    "more",
    [
        {},
        {"learning_rate": 5e-3, "desired_kl": 0.001},
        {"use_clipped_value_loss": False, "normalize_advantage_per_mini_batch": True},
        {"schedule": "fixed", "entropy_coef": 0.1},
    ],
)
def test_it_learns_what_rsl_rl_learns(more):
    env_a, env_b = NoiseEnv(), NoiseEnv()
    a, b = build("PPO", env_a, **more), build("vinl.loco.fast_ppo:FastPPO", env_b, **more)
    assert type(b) is FastPPO
    for one, two in zip(learn(a, env_a, 3), learn(b, env_b, 3), strict=True):
        assert two == pytest.approx(one, rel=1e-3, abs=1e-5)
    assert_same_weights(a, b)


def test_a_schedule_may_move_rate_divergence_and_entropy():
    env_a, env_b = NoiseEnv(), NoiseEnv()
    a, b = build("PPO", env_a), build("vinl.loco.fast_ppo:FastPPO", env_b)
    for algorithm, env in ((a, env_a), (b, env_b)):
        learn(algorithm, env, 1)
        algorithm.desired_kl, algorithm.learning_rate, algorithm.entropy_coef = None, 2e-3, 0.0
        for group in algorithm.optimizer.param_groups:  # as the warm-up of the critic does
            group["lr"] = 2e-3
        algorithm.get_policy().requires_grad_(False)
        frozen = copy.deepcopy(algorithm.actor.state_dict())
        assert learn(algorithm, env, 1)[0]["rate"] == pytest.approx(2e-3)
        assert all(torch.equal(w, frozen[k]) for k, w in algorithm.actor.state_dict().items())
        algorithm.get_policy().requires_grad_(True)
        algorithm.desired_kl = 0.01
        learn(algorithm, env, 1)
    assert_same_weights(a, b)


def test_a_limit_holds_a_rate_that_follows_the_divergence():
    env = NoiseEnv()
    algorithm = build("vinl.loco.fast_ppo:FastPPO", env, desired_kl=1.0)  # never reached: the rate rises
    assert learn(algorithm, env, 1)[0]["rate"] > 2e-3
    algorithm.limit_rate(5e-4)
    assert [row["rate"] for row in learn(algorithm, env, 2)] == pytest.approx([5e-4, 5e-4])


def test_either_goes_on_from_the_others_state():
    env_a, env_b = NoiseEnv(), NoiseEnv()
    slow, fast = build("PPO", env_a), build("vinl.loco.fast_ppo:FastPPO", env_b)
    learn(slow, env_a, 2), learn(fast, env_b, 2)
    crossed_slow, crossed_fast = build("PPO", NoiseEnv()), build("vinl.loco.fast_ppo:FastPPO", NoiseEnv())
    crossed_fast.load(copy.deepcopy(slow.save()), None, True)
    crossed_slow.load(copy.deepcopy(fast.save()), None, True)
    learn(crossed_slow, env_a, 1), learn(crossed_fast, env_b, 1)
    assert_same_weights(crossed_slow, crossed_fast)
    assert crossed_slow.learning_rate == pytest.approx(crossed_fast.learning_rate, rel=1e-4)


def test_what_it_does_not_know_is_refused():
    with pytest.raises(ValueError, match="mixed precision"):
        build("vinl.loco.fast_ppo:FastPPO", NoiseEnv(), use_mixed_precision=True)


def test_actions_are_drawn_as_rsl_rl_draws_them():
    mean, drawn = torch.randn(500, 12), []
    for kind in (GaussianDistribution, UncheckedGaussian):
        torch.manual_seed(4)
        distribution = kind(12, init_std=0.3)
        distribution.update(mean)
        drawn.append(distribution.sample())
    assert torch.equal(*drawn) and not drawn[1].requires_grad


SHARED = [
    {"num_mini_batches": 1, "learning_rate": 3e-3},
    {"num_mini_batches": 1, "normalize_advantage_per_mini_batch": True, "desired_kl": 1e-3},
]
"""One minibatch of all steps: whose robots are in it is not left to chance."""


def learn_in_parts(robots, seed, peers=None):
    """Weights, losses and rates, and divergences of three updates, by ``SHARED``; actions are drawn for all N robots
    alike."""
    results = []
    for more in SHARED:
        env = NoiseEnv(robots)
        algorithm = build("vinl.loco.fast_ppo:FastPPO", env, seed, peers=peers, **more)
        spread, chance = algorithm.actor.distribution, torch.Generator().manual_seed(7)

        def sample(spread=spread, chance=chance, env=env):
            mean = spread.mean.detach()
            if len(mean) != env.num_envs:  # of a minibatch, where nobody acts
                return mean
            return mean + spread.std.detach() * torch.randn(N, ACTIONS, generator=chance)[env.robots]

        spread.sample = sample
        steer, kls = algorithm.rate.steer, []
        algorithm.rate.steer = lambda kl, steer=steer, kls=kls: (kls.append(float(kl)), steer(kl))
        rows = learn(algorithm, env, 3)
        weights = {
            **algorithm.actor.state_dict(),
            **{f"critic.{k}": w for k, w in algorithm.critic.state_dict().items()},
        }
        results.append({"rows": rows, "weights": weights, "kls": kls})
    return results


def _learn_in_process(peers):
    half = slice(peers.rank * N // 2, (peers.rank + 1) * N // 2)
    return learn_in_parts(half, 1 + peers.rank, peers)  # each with fresh weights of its own


@pytest.mark.slow
def test_two_processes_learn_what_one_learns_from_all_robots(tmp_path):
    first, second = run_two(_learn_in_process, tmp_path)
    for one, two, whole in zip(first, second, learn_in_parts(slice(None), 1), strict=True):
        assert one["rows"] == two["rows"] and one["kls"] == two["kls"]
        assert one["kls"] == pytest.approx(whole["kls"], rel=1e-2, abs=1e-6)
        assert all(torch.equal(w, two["weights"][k]) for k, w in one["weights"].items())
        for of_two, of_one in zip(one["rows"], whole["rows"], strict=True):
            assert of_two == pytest.approx(of_one, rel=1e-3, abs=1e-5)
        assert all(torch.allclose(w, whole["weights"][k], atol=2e-5, rtol=1e-4) for k, w in one["weights"].items())
    assert len({row["rate"] for row in first[1]["rows"]}) > 1
