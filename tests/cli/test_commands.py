"""vinl policies, vinl doctor, vinl bench: what they print, and what they say to bad input."""

import json
import re
import shutil
from pathlib import Path

import pytest
import torch

from vinl.cli import doctor
from vinl.cli.app import main
from vinl.cli.policies import count
from vinl.policies.card import locomotion_card
from vinl.policies.io import WEIGHTS_FILE, find_policy, save_policy
from vinl.policies.networks import StepActor


@pytest.fixture
def policy(tmp_path: Path) -> Path:
    torch.manual_seed(0)
    network = StepActor(actor=(16,))
    figures = {"flat": {"falls": 0.0, "linear_velocity_rmse": 0.0812345}}
    card = locomotion_card("rough", network.describe(), gait={}, samples=128_000_000, evaluation=figures)
    return save_policy(tmp_path / "assets" / "policies" / "rough", network, card)


@pytest.fixture
def shipped(policy: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr("vinl.policies.io.assets_dir", lambda: tmp_path / "assets")
    return policy


def test_table_of_policies(shipped: Path, capsys: pytest.CaptureFixture[str]):
    assert main(["policies"]) == 0
    said = capsys.readouterr().out
    for word in ("rough", "locomotion", "the true ground", "128 M"):
        assert word in said


def test_one_card(shipped: Path, capsys: pytest.CaptureFixture[str]):
    assert main(["policies", "vinl/rough"]) == 0
    said = capsys.readouterr().out
    assert "foothold (8)" in said and "action scale [rad]" in said and "StepActor" in said
    assert main(["policies", str(shipped), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["samples"] == 128_000_000


def test_the_command_under_a_card_works_for_a_folder_too(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    folder = shutil.copytree(find_policy("nav"), tmp_path / "mine")  # a card with figures of several evaluations
    assert main(["policies", str(folder)]) == 0
    command = re.search(r"the whole card: vinl (.+?);", capsys.readouterr().out)
    assert command is not None and main(command[1].split()) == 0
    assert json.loads(capsys.readouterr().out)["kind"] == "navigation"


def test_no_policy_says_how_to_get_one(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]):
    monkeypatch.setattr("vinl.policies.io.list_policies", list)
    assert main(["policies"]) == 0
    assert "vinl train-loco" in capsys.readouterr().out


def test_count():
    assert [count(n) for n in (0, 999, 1500, 128_000_000, 2 * 10**9)] == ["0", "999", "1.5 k", "128 M", "2 G"]


@pytest.mark.parametrize(
    ("argv", "message"),
    [
        (["policies", "ruogh"], "unknown policy 'ruogh', did you mean 'rough'?; shipped: rough"),
        (["policies", "--jsn"], "Unrecognized options: --jsn, did you mean --json? (vinl policies --help"),
        (["policies", "assets"], "assets is no policy folder: card.json is missing"),
        (["policies", "a", "b"], "Unrecognized options: b"),
        (["bench", "nothing"], "there is no benchmark 'nothing'; choose loco, nav, depth or memory"),
        (["bench", "loco", "--num-envs", "-4"], "--num-envs must be positive, got -4"),
        (["bench", "loco", "--seconds", "many"], "--seconds must be a number, got 'many'"),
        (["bench", "loco", "--device", "gpu"], "unknown device 'gpu'; use cpu"),
        (["bench", "loco", "--config", "loco/ruff"], "unknown config 'loco/ruff', did you mean 'loco/rough'"),
        (["bench", "depth", "--num-images", "0"], "--num-images must be positive, got 0"),
        (["bench", "depth", "--seconds", "nan"], "--seconds must be positive, got nan"),
        (["doctor", "now"], "Unrecognized options: now"),
    ],
)
def test_bad_input_is_one_line(argv: list[str], message: str, shipped: Path, capsys: pytest.CaptureFixture[str]):
    before = sorted(Path().rglob("*"))
    assert main(argv) == 2
    said = capsys.readouterr()
    assert said.err.startswith("error: ") and said.err.count("\n") == 1 and said.out == ""
    assert message in said.err
    assert sorted(Path().rglob("*")) == before


def test_broken_weights_do_not_hide_the_card(shipped: Path, capsys: pytest.CaptureFixture[str]):
    (shipped / WEIGHTS_FILE).write_bytes(b"cut")
    assert main(["policies", "rough"]) == 0
    assert "rough" in capsys.readouterr().out


@pytest.mark.parametrize("command", ["policies", "doctor", "bench"])
def test_help_of_each(command: str, capsys: pytest.CaptureFixture[str]):
    try:
        assert main([command, "--help"]) == 0
    except SystemExit as end:
        assert not end.code
    assert f"vinl {command}" in capsys.readouterr().out


def test_bench_depth_runs(capsys: pytest.CaptureFixture[str]):
    small = {"num-images": 2, "width": 8, "height": 6, "homes": 1, "seconds": 0.05, "device": "cpu"}
    options = [f"--{name}={value}" for name, value in small.items()]
    assert main(["bench", "depth", "--json", *options]) == 0
    figures = json.loads(capsys.readouterr().out)
    assert figures["images_per_s"] > 0 and figures["num_images"] == 2
    assert main(["bench", "depth", *options]) == 0
    assert "images_per_s" in capsys.readouterr().out


def plant(monkeypatch: pytest.MonkeyPatch, *rows: tuple) -> None:
    monkeypatch.setattr(doctor, "CHECKS", rows)
    monkeypatch.setattr(doctor, "_devices", lambda: {"torch": "cpu"})


def test_doctor_passes_on(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]):
    plant(monkeypatch, ("legs", lambda: "four", ()), ("wings", lambda: "two", ("no-such-package",)))
    assert main(["doctor"]) == 0
    said = capsys.readouterr().out
    assert "four" in said and "no-such-package missing: pip install" in said and "all parts work" in said


def test_doctor_reports_a_failure_and_goes_on(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]):
    def lame() -> str:
        raise RuntimeError("one leg is lame")

    plant(monkeypatch, ("legs", lame, ()), ("eyes", lambda: "two", ()))
    assert main(["doctor", "--json"]) == 1
    checks = json.loads(capsys.readouterr().out)["checks"]
    assert [(c["part"], c["state"]) for c in checks] == [("legs", "failed"), ("eyes", "ok")]
    assert checks[0]["detail"] == "RuntimeError: one leg is lame"
    assert main(["doctor"]) == 1
    assert "failed: legs" in capsys.readouterr().out


@pytest.mark.parametrize("name", ["configs", "depth camera", "physics", "policy", "video"])
def test_light_checks_pass_here(name: str):
    check = {part: function for part, function, _ in doctor.CHECKS}[name]
    assert check()
