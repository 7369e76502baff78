"""Training of the navigator from the command line: it runs on a CPU, goes on after a kill, in several processes too."""

import json
import shutil
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import pytest
import torch

from vinl.cli.app import main
from vinl.config.errors import InputError
from vinl.config.loader import build_config
from vinl.nav import training
from vinl.nav.config import NavConfig
from vinl.nav.learning_config import NavPpoConfig
from vinl.nav.recurrent_model import build_actor, load_critic, load_start, save_critic
from vinl.nav.training import build_algorithm, build_environment, make_card, separate
from vinl.policies.card import read_card
from vinl.policies.io import load_policy, save_policy
from vinl.policies.nav_actor import NavActor

SMALL = """
homes: {count: 2, goals: 2, starts: 32, workers: 0, plans: [harbour_flat], plans_share: 1.0}
camera: {width: 32, height: 24}
network: {vision: cnn, hidden: 16, visual: 16, embedding: 4, layers: 1}
episodes: {steps: 6}
ppo: {steps: 4, epochs: 1, minibatches: 2}
"""


@pytest.fixture
def small(tmp_path) -> Path:
    path = tmp_path / "small.yaml"
    path.write_text(SMALL)
    return path


def train(config, out, *more: str) -> int:
    return main(["train-nav", "--device", "cpu", "--config", str(config), "--num-envs", "8", "--out", str(out), *more])


def weights(folder: Path) -> dict[str, torch.Tensor]:
    return torch.load(folder / "checkpoint.pt", weights_only=True)["algorithm"]["model"]


def rows(folder: Path) -> list[dict]:
    return [json.loads(line) for line in (folder / "metrics.jsonl").read_text().splitlines()]


@pytest.mark.parametrize("config", ["default", "paper", "blind"])
def test_shipped_configs_can_be_trained(config, tmp_path):
    small = [
        "homes.plans=[harbour_flat]",
        "homes.plans_share=1.0",
        "homes.count=1",
        "homes.goals=1",
        "homes.starts=8",
        "ppo.steps=2",
        "ppo.epochs=1",
        "ppo.minibatches=2",
        "network.planes=16",
    ]
    image = [] if config == "blind" else ["camera.width=32", "camera.height=24"]
    assert train(config, tmp_path / "run", "--iterations", "2", *small, *image) == 0
    policy = load_policy(tmp_path / "run")
    assert policy.card.kind == "navigation" and policy.card.samples == 2 * 8 * 2
    assert (policy.camera is None) == (config == "blind")
    assert [row["iteration"] for row in rows(tmp_path / "run")] == [1, 2]


@pytest.mark.slow
def test_killed_and_resumed_it_ends_with_the_very_weights_of_a_run_never_stopped(tmp_path, small):
    straight, killed = tmp_path / "straight", tmp_path / "killed"
    assert train(small, straight, "--iterations", "30") == 0
    command = [sys.executable, "-m", "vinl.cli.app", "train-nav", "--device", "cpu", "--num-envs", "8"]
    command += ["--config", str(small), "--out", str(killed), "--save-every", "0.001", "--iterations", "30"]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
        deadline = time.monotonic() + 200
        while not (killed / "policy").exists() and time.monotonic() < deadline and process.poll() is None:
            time.sleep(0.01)
        process.send_signal(signal.SIGKILL)
    assert 1 <= torch.load(killed / "checkpoint.pt", weights_only=True)["iteration"] < 30
    assert main(["train-nav", "--device", "cpu", "--resume", str(killed)]) == 0
    assert [row["iteration"] for row in rows(killed)] == list(range(1, 31))
    whole, parts = weights(straight), weights(killed)
    assert all(torch.equal(whole[name], parts[name]) for name in whole)


def test_a_complete_run_says_so_before_anything_is_built(tmp_path, small, capsys, monkeypatch):
    run = tmp_path / "run"
    assert train(small, run, "--iterations", "1") == 0
    capsys.readouterr()
    built = []
    monkeypatch.setattr(training, "build_environment", lambda *given: built.append(given) or build_environment(*given))
    again = ["train-nav", "--device", "cpu", "--resume", str(run)]
    assert main(again) == 0 and not built
    assert f"trained: {run}/policy" in capsys.readouterr().out
    (run / "policy" / "card.json").write_text("{")  # what cannot be read is written anew
    assert main(again) == 0 and len(built) == 1 and load_policy(run).card.samples == 32
    shutil.rmtree(run / "policy")  # as if it had been killed between checkpoint and policy
    assert main(again) == 0 and len(built) == 2 and load_policy(run).card.samples == 32


def test_more_iterations_go_on_and_another_run_starts_from_the_policy(tmp_path, small):
    first, second = tmp_path / "first", tmp_path / "second"
    assert train(small, first, "--iterations", "1") == 0
    assert main(["train-nav", "--device", "cpu", "--resume", str(first), "--iterations", "3"]) == 0
    assert [row["samples"] for row in rows(first)] == [32, 64, 96]
    assert train(small, second, "--iterations", "1", "--from", str(first), "ppo.learning_rate=2e-4") == 0
    training = load_policy(second).card.training
    assert training["origin"] == {"policy": str(first), "samples": 96}
    assert [row["samples"] for row in training["lineage"]] == [96, 32] and training["total_samples"] == 128


def test_who_starts_from_a_run_gets_its_critic(tmp_path):
    config = build_config(NavConfig, {"num_envs": 4, "camera": None, "network": {"hidden": 8, "layers": 1}})
    first, second = build_algorithm(config, "cpu").model, build_algorithm(config, "cpu").model
    with torch.no_grad():
        first.log_std.fill_(-1.2)
    assert not torch.equal(first.value[0].weight, second.value[0].weight)
    assert not load_critic(second, tmp_path)  # a policy alone
    save_critic(first, tmp_path)
    assert load_critic(second, tmp_path)
    assert torch.equal(first.value[0].weight, second.value[0].weight) and second.log_std[0].item() == pytest.approx(
        -1.2
    )
    wider = build_config(NavConfig, {"num_envs": 4, "camera": None, "network": {"hidden": 16, "layers": 1}})
    assert not load_critic(build_algorithm(wider, "cpu").model, tmp_path)
    (tmp_path / "critic.safetensors").write_bytes(b"broken")
    with pytest.raises(InputError, match=r"critic\.safetensors is broken"):
        load_critic(second, tmp_path)


def test_a_fresh_critic_learns_before_the_actor_does(tmp_path, small):
    start, early, later = tmp_path / "start", tmp_path / "early", tmp_path / "later"
    assert train(small, start, "--iterations", "1") == 0
    origin = str(start / "policy")  # a policy has no critic
    for out, count in ((early, "2"), (later, "3")):
        assert train(small, out, "--iterations", count, "--from", origin, "ppo.critic_warmup=2") == 0
    given, held, moved = weights(start), weights(early), weights(later)
    actor = [name for name in given if name.startswith("actor.") and given[name].is_floating_point()]
    assert all(torch.equal(given[name], held[name]) for name in actor)
    assert held["log_std"].tolist() == [-0.5, -0.5]
    assert not torch.equal(held["value.0.weight"], given["value.0.weight"])
    assert not any(torch.equal(moved[name], held[name]) for name in actor if name.endswith("weight"))


def test_time_ends_a_training_and_cools_it(tmp_path, small, capsys):
    run = tmp_path / "run"
    more = ["ppo.last_log_std=-1.9", "ppo.cool_from=0", "ppo.last_rate=1e-5"]
    assert train(small, run, "--iterations", "100000", "--minutes", "0.05", *more) == 0
    assert "trained" in capsys.readouterr().out
    curve = rows(run)
    assert 1 <= len(curve) < 1000
    assert read_card(run / "policy").training["iterations"] == len(curve)
    assert len(curve) < 3 or curve[-1]["action_std"] < curve[0]["action_std"] - 0.05


@pytest.mark.slow
def test_two_processes_train_one_policy(tmp_path, small):
    assert train(small, tmp_path / "run", "--iterations", "2", "--devices", "2") == 0
    run = tmp_path / "run"
    assert rows(run)[-1]["samples"] == 2 * 2 * 8 * 4
    follower = torch.load(run / "rank1" / "checkpoint.pt", weights_only=True)
    assert all(torch.equal(w, follower["algorithm"]["model"][k]) for k, w in weights(run).items())
    assert not torch.equal(
        follower["environment"]["robots"]["position"],
        torch.load(run / "checkpoint.pt", weights_only=True)["environment"]["robots"]["position"],
    )
    again = ["train-nav", "--device", "cpu", "--resume", str(run), "--devices", "2", "--iterations"]
    assert main([*again, "3"]) == 0
    assert rows(run)[-1]["samples"] == 3 * 2 * 8 * 4
    # they go on together, and end together though each has a clock
    assert main([*again, "100000", "--minutes", "0.03"]) == 0
    done = [row["iteration"] for row in rows(run)]
    assert done == list(range(1, len(done) + 1)) and len(done) > 3
    assert rows(run)[-1]["samples"] == len(done) * 2 * 8 * 4
    follower = torch.load(run / "rank1" / "checkpoint.pt", weights_only=True)
    assert all(torch.equal(w, follower["algorithm"]["model"][k]) for k, w in weights(run).items())


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--config", "nothing"], "nav/nothing"),
        (["--num-envs", "6", "ppo.minibatches=4"], "ppo.minibatches"),
        (["--iterations", "0"], "--iterations"),
        (["--devices", "0"], "--devices"),
        (["--minutes", "0"], "--minutes"),
        (["ppo.epoch=3"], "ppo.epoch"),
        (["ppo.schedule=fast"], "ppo.schedule"),
        (["ppo.min_rate=1"], "min_rate"),
        (["network.vision=eagle"], "network.vision"),
        (["--save-every", "0"], "--save-every"),
        (["--resume", "x", "--seed", "3"], "--resume"),
        (["--resume", "x"], "no training run"),
        (["--from", "rough", "homes.count=1"], "locomotion policy"),
    ],
)
def test_bad_options_are_one_line(arguments, message, capsys, tmp_path):
    assert main(["train-nav", "--device", "cpu", *arguments]) == 2
    error = capsys.readouterr().err
    assert message in error and len(error.strip().splitlines()) == 1 and "Traceback" not in error
    assert not any(tmp_path.iterdir())


def test_policies_are_kept_aside_and_a_profile_is_written(tmp_path, small):
    run = tmp_path / "run"
    more = ["ppo.keep_at=[32, 100, 1000]", "ppo.last_log_std=-1.5"]
    assert train(small, run, "--iterations", "7", "--profile", *more) == 0
    assert sorted(p.name for p in (run / "kept").iterdir()) == ["0.0001M", "3.2e-05M"]
    assert load_policy(run / "kept" / "0.0001M").card.samples == 128
    assert rows(run)[-1]["action_std"] < 0.55  # from 0.61
    assert "aten::" in (run / "profile.txt").read_text()


def test_another_network_than_the_policys_is_refused(tmp_path):
    config = build_config(NavConfig, {"camera": {"width": 32, "height": 24}, "network": {"vision": "cnn"}})
    save_policy(tmp_path / "p", build_actor(config), make_card("p", config, 5, "abc"))
    assert isinstance(load_policy(tmp_path / "p").network, NavActor)
    other = replace(config, network=replace(config.network, hidden=64))
    with pytest.raises(InputError, match="hidden 512 instead of 64"):
        load_start(str(tmp_path / "p"), other)


def test_the_learning_rate_and_the_entropy_cool_down():
    ppo = NavPpoConfig(
        learning_rate=5e-4, min_rate=2e-4, max_rate=1e-3, cool_from=0.5, last_rate=1e-5, last_entropy=0.0
    )
    assert ppo.rate_limits(0.0) == ppo.rate_limits(0.5) == (2e-4, 1e-3)
    assert ppo.rate_limits(1.0) == pytest.approx((1e-5, 1e-5))
    assert ppo.rate_limits(0.75) == pytest.approx((1.05e-4, 5.05e-4))
    assert NavPpoConfig(cool_from=0.5, last_log_std=-1.8).spread_at(0.75) == pytest.approx((-2.0, -0.8))
    assert ppo.spread_at(1.0) == ppo.log_std_range
    assert ppo.entropy_at(0.5) == 0.003 and ppo.entropy_at(1.0) == 0.0


def test_processes_have_homes_and_chance_of_their_own():
    config = NavConfig()
    one = separate(config, 1)
    assert one.seed != config.seed and one.homes.seed - config.homes.seed >= 1_000_000
    assert separate(config, 0) == config


def test_settings_reach_the_algorithm():
    config = build_config(NavConfig, {"num_envs": 4, "camera": None, "ppo": {"clip": 0.1, "steps": 3, "lam": 0.9}})
    algorithm = build_algorithm(config, "cpu")
    assert (algorithm.config.clip, algorithm.config.lam, algorithm.storage.steps) == (0.1, 0.9, 3)
    assert algorithm.storage.depth is None and algorithm.model.actor.image is None
