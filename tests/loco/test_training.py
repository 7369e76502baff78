"""Training from the command line: it runs on a CPU, survives SIGKILL, and goes on to the very same weights."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
import torch

from vinl.cli import train_loco
from vinl.cli.app import main
from vinl.config.errors import InputError
from vinl.gait.observation import STEPPING_TABLE
from vinl.loco.training import train_locomotor
from vinl.policies.io import load_policy

TRAIN = [sys.executable, "-m", "vinl.cli.app", "train-loco", "--device", "cpu"]


def weights(folder: Path) -> dict[str, torch.Tensor]:
    return torch.load(folder / "checkpoint.pt", weights_only=True)["algorithm"]["actor_state_dict"]


def count_rows(folder: Path) -> int:
    metrics = folder / "metrics.jsonl"
    return len(metrics.read_text().splitlines()) if metrics.exists() else 0


@pytest.mark.slow
def test_killed_and_resumed_ends_with_the_very_weights_of_a_run_never_stopped(tmp_path, small_overrides):
    straight, killed = tmp_path / "straight", tmp_path / "killed"
    iterations = "iterations=16"
    # all in processes of their own: the number of threads, which others may have set here, decides the last bits
    subprocess.run([*TRAIN, "--out", str(straight), *small_overrides, iterations], check=True)
    command = [*TRAIN, "--out", str(killed), "--save-every", "0.001", *small_overrides, iterations]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
        deadline = time.monotonic() + 200
        # several iterations, each saved: neither saving nor resuming may change what is learned
        while count_rows(killed) < 4 and time.monotonic() < deadline and process.poll() is None:
            time.sleep(0.01)
        process.send_signal(signal.SIGKILL)
    done = torch.load(killed / "checkpoint.pt", weights_only=True)["iteration"]
    assert 3 <= done < 16
    subprocess.run([*TRAIN, "--resume", str(killed)], check=True)
    rows = [json.loads(line) for line in (killed / "metrics.jsonl").read_text().splitlines()]
    assert [row["iteration"] for row in rows] == list(range(1, 17))
    whole, parts = weights(straight), weights(killed)
    assert all(torch.equal(whole[name], parts[name]) for name in whole)
    policy = load_policy(killed)
    policy.reset(3)
    assert np.isfinite(policy.act(np.zeros((3, STEPPING_TABLE.size), np.float32))).all()
    assert policy.card.samples == 16 * 8 * 4


def test_resume_of_no_run_is_refused(tmp_path, capsys):
    assert main(["train-loco", "--resume", str(tmp_path), "--device", "cpu"]) == 2
    assert "no training run" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--stage", "9"], "--stage 9"),
        (["--num-envs", "-4"], "num_envs"),
        (["--num-envs", "99999999"], "num_envs"),
        (["--iterations", "0"], "iterations"),
        (["--config", "loco/nothing"], "nothing"),
        (["ppo.epoch=3"], "ppo.epoch"),
        (["--save-every", "-1"], "--save-every"),
        (["--resume", "x", "--seed", "3"], "--resume"),
        (["--device", "tpu"], "tpu"),
        (["--devices", "0"], "--devices"),
        (["--devices", "3", "--num-envs", "8"], "--devices 3: num_envs"),
        (["ppo.update=rsl_rl"], "ppo.update"),
        (["--devices", "2", "--stage", "3", "--from", "teacher"], "stage 3 is trained on one device"),
    ],
)
def test_bad_options_are_one_line(arguments, message, capsys, tmp_path):
    device = [] if "--device" in arguments else ["--device", "cpu"]
    assert main(["train-loco", *device, *arguments]) == 2
    error = capsys.readouterr().err
    assert message in error and len(error.strip().splitlines()) == 1 and "Traceback" not in error
    assert not any(tmp_path.iterdir())


def test_more_gpus_than_there_are_are_refused(capsys, monkeypatch):
    monkeypatch.setattr(torch.cuda, "is_available", lambda: True)
    monkeypatch.setattr(torch.cuda, "device_count", lambda: 1)
    assert main(["train-loco", "--device", "cuda", "--devices", "2"]) == 2
    assert capsys.readouterr().err == "error: --devices 2: there are only 1 CUDA devices\n"


@pytest.mark.parametrize(("seen", "own"), [(None, "1"), ("4,6,7", "6"), ("-1", "")])
def test_each_process_sees_one_gpu(seen, own, monkeypatch):
    monkeypatch.setenv("LOCAL_RANK", "1")
    monkeypatch.setenv("CUDA_VISIBLE_DEVICES", seen or "")
    if seen is None:
        monkeypatch.delenv("CUDA_VISIBLE_DEVICES")
    train_loco._see_one_gpu()
    assert (os.environ["CUDA_VISIBLE_DEVICES"], os.environ["LOCAL_RANK"]) == (own, "0")


def test_devices_share_the_robots(small_config):
    parts = [small_config.separate(rank, 2) for rank in (0, 1)]
    assert [(part.num_envs, part.seed) for part in parts] == [(4, 1), (4, 2)]
    assert parts[1].terrain == small_config.terrain and small_config.separate(0, 1) is small_config


@pytest.mark.slow
def test_two_processes_train_one_policy(tmp_path, small_overrides, capfd):
    run, all_robots = tmp_path / "run", "num_envs=16"  # eight each: compiled for other tests already
    two = ["train-loco", "--device", "cpu", "--devices", "2"]
    assert main([*two, "--out", str(run), *small_overrides, all_robots, "iterations=2"]) == 0
    assert capfd.readouterr().out.count("trained") == 1
    assert main([*two, "--resume", str(run), "--iterations", "3"]) == 0
    first, second = (torch.load(p / "checkpoint.pt", weights_only=True) for p in (run, run / "rank1"))
    for name in ("actor_state_dict", "critic_state_dict"):
        other = second["algorithm"][name]
        assert all(torch.equal(w, other[k]) for k, w in first["algorithm"][name].items())
    assert not torch.equal(first["environment"]["body.qpos"], second["environment"]["body.qpos"])
    assert count_rows(run) == first["iteration"] == 3 and not count_rows(run / "rank1")
    assert first["samples"] == load_policy(run).card.samples == 3 * 16 * 4
    assert main(["train-loco", "--device", "cpu", "--resume", str(run)]) == 2
    assert f"--devices 1: {run} was trained on 2" in capfd.readouterr().err


def test_cuda_without_cuda_is_refused(capsys, tmp_path):
    if torch.cuda.is_available():
        with pytest.raises(InputError):
            train_locomotor(None, tmp_path, device="cuda")
        return
    assert main(["train-loco", "--device", "cuda"]) == 2
    assert "--device cpu" in capsys.readouterr().err
