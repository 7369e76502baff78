"""``vinl eval`` and ``vinl eval-loco``: what they write, and bad input."""

import json
from pathlib import Path

import pytest

from vinl.cli.app import main
from vinl.policies.io import save_policy
from vinl.policies.policy import LocomotionPolicy
from vinl.world.readers import shipped_floorplans

PLAN = shipped_floorplans()[0]


@pytest.fixture
def policy(standing: LocomotionPolicy, tmp_path: Path) -> str:
    return str(save_policy(tmp_path / "standing", standing.network, standing.card))


def test_eval_writes_figures_and_report(policy: str, capsys: pytest.CaptureFixture[str]) -> None:
    options = (
        f"--floorplans {PLAN} --loco {policy} --episodes 1 --seeds 1 --workers 1 --set time_limit=0.5 --out runs/a"
    )
    assert main(["eval", *options.split()]) == 0
    written = ["episodes.jsonl", "plans", "report.html", "results.json", "run.json"]
    assert sorted(path.name for path in Path("runs/a").iterdir()) == written
    data = json.loads(Path("runs/a/results.json").read_text())
    assert data["aggregate"]["episodes"] == 1
    assert data["config"]["evaluation"]["time_limit"] == 0.5
    said = capsys.readouterr().out
    assert "report.html" in said and "results.json" in said


def test_eval_loco_writes_figures(policy: str) -> None:
    assert main(["eval-loco", *f"--policy {policy} --robots 2 --seconds 0.2 --workers 1 --out loco".split()]) == 0
    assert json.loads(Path("loco/results.json").read_text())["aggregate"]["falls"] == 0


@pytest.mark.parametrize(
    ("command", "words"),
    [
        ("eval --out a --episodes 0", "--episodes"),
        ("eval --out a --seeds -2", "--seeds"),
        ("eval --out a --workers 0", "--workers"),
        ("eval --out a --obstacles many", "--obstacles"),
        ("eval --out a --loco nobody", "unknown policy"),
        ("eval --out a --nav nobody", "unknown navigator"),
        ("eval --out a --floorplans nowhere.png", "nowhere.png"),
        ("eval --out a --set time_limit=-1", "time_limit"),
        ("eval --out a --set tim_limit=1", "did you mean"),
        ("eval --out a --device cuda", "cuda"),
        ("eval --out a --cluster nonsense", "is no address"),
        ("eval --out a --cluster local --device cuda", "asks policies on CPUs"),
        ("eval --out taken", "is a file"),
        ("eval-loco --out a --robots -1", "--robots"),
        ("eval-loco --out a --seconds 0", "--seconds"),
        ("eval-loco --out a --terrain swamp", "--terrain"),
        ("eval-loco --out a --terrain rough --level 11", "--level"),
        ("eval-loco --out a --terrain blocks --density 99", "--density"),
        ("eval-loco --out a --policy nobody", "unknown policy"),
        ("eval-loco --out taken", "is a file"),
    ],
)
def test_bad_input_is_one_line(
    command: str, words: str, policy: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("torch.cuda.is_available", lambda: False)
    Path("taken").write_text("")
    argv = command.split()
    if "--loco" not in argv and argv[0] == "eval":
        argv += ["--loco", policy]
    if "--policy" not in argv and argv[0] == "eval-loco":
        argv += ["--policy", policy]
    assert main(argv) == 2
    error = capsys.readouterr().err
    assert error.startswith("error: ") and error.count("\n") == 1
    assert words in error
    assert not Path("a").exists()
