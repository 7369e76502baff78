"""Training from the command line: it runs on a CPU, survives SIGKILL, and goes on to the very same weights."""

import json
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
import torch

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
    iterations = "iterations=40"
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
    assert 3 <= done < 40
    subprocess.run([*TRAIN, "--resume", str(killed)], check=True)
    rows = [json.loads(line) for line in (killed / "metrics.jsonl").read_text().splitlines()]
    assert [row["iteration"] for row in rows] == list(range(1, 41))
    whole, parts = weights(straight), weights(killed)
    assert all(torch.equal(whole[name], parts[name]) for name in whole)
    policy = load_policy(killed)
    policy.reset(3)
    assert np.isfinite(policy.act(np.zeros((3, STEPPING_TABLE.size), np.float32))).all()
    assert policy.card.samples == 40 * 8 * 4


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
    ],
)
def test_bad_options_are_one_line(arguments, message, capsys, tmp_path):
    device = [] if "--device" in arguments else ["--device", "cpu"]
    assert main(["train-loco", *device, *arguments]) == 2
    error = capsys.readouterr().err
    assert message in error and len(error.strip().splitlines()) == 1 and "Traceback" not in error
    assert not any(tmp_path.iterdir())


def test_cuda_without_cuda_is_refused(capsys, tmp_path):
    if torch.cuda.is_available():
        with pytest.raises(InputError):
            train_locomotor(None, tmp_path, device="cuda")
        return
    assert main(["train-loco", "--device", "cuda"]) == 2
    assert "--device cpu" in capsys.readouterr().err
