"""Runs on disk: nothing is lost, nothing is half-written, broken files are named."""

import json

import pytest
import torch

from vinl.config.errors import InputError
from vinl.rl.run_folder import CHECKPOINT, CONFIG, METRICS, RunFolder


def test_config_and_checkpoint_come_back(tmp_path):
    run = RunFolder(tmp_path / "a" / "run")
    run.create({"seed": 3})
    assert run.open() == {"seed": 3}
    assert run.load_checkpoint() is None
    run.save_checkpoint({"iteration": 7, "x": torch.arange(3)})
    assert run.load_checkpoint()["iteration"] == 7
    assert sorted(p.name for p in run.path.iterdir()) == [CHECKPOINT, CONFIG]


def test_a_run_is_never_overwritten(tmp_path):
    RunFolder(tmp_path / "run").create({})
    with pytest.raises(InputError, match="--resume"):
        RunFolder(tmp_path / "run").create({})
    (tmp_path / "file").write_text("x")
    with pytest.raises(InputError, match="is a file"):
        RunFolder(tmp_path / "file").create({})


def test_what_is_no_run_is_named(tmp_path):
    with pytest.raises(InputError, match="no training run"):
        RunFolder(tmp_path).open()
    (tmp_path / CONFIG).write_text("a: [1")
    with pytest.raises(InputError, match="broken"):
        RunFolder(tmp_path).open()


@pytest.mark.parametrize("damage", [b"", b"not a checkpoint", None])
def test_a_broken_checkpoint_is_named(tmp_path, damage):
    run = RunFolder(tmp_path / "run")
    run.create({})
    run.save_checkpoint({"x": torch.zeros(1000)})
    file = run.path / CHECKPOINT
    file.write_bytes(file.read_bytes()[:300] if damage is None else damage)
    with pytest.raises(InputError, match=r"checkpoint\.pt is broken"):
        run.load_checkpoint()


def test_curves_are_cut_to_the_checkpoint(tmp_path):
    run = RunFolder(tmp_path)
    for k in (1, 2, 3):
        run.append_metrics({"iteration": k})
    with (tmp_path / METRICS).open("a") as file:
        file.write('{"iteration": 4, "rew')  # as a kill leaves it
    run.cut_metrics(2)
    run.append_metrics({"iteration": 3})
    lines = (tmp_path / METRICS).read_text().splitlines()
    assert [json.loads(line)["iteration"] for line in lines] == [1, 2, 3]
