"""``vinl eval-loco``: what it writes, and bad input."""

import io
import json
from pathlib import Path

import pytest
from rich.console import Console

from vinl.cli.app import main
from vinl.config.output import choose_out, write_json
from vinl.courses import report
from vinl.courses.evaluate import TrialResults
from vinl.courses.robot_records import HEIGHT_NAMES
from vinl.policies.io import save_policy
from vinl.policies.policy import LocomotionPolicy


@pytest.fixture
def policies(standing: LocomotionPolicy, trotting: LocomotionPolicy) -> list[str]:
    """Two policy folders."""
    for policy in (standing, trotting):
        save_policy(Path("runs") / policy.card.name, policy.network, policy.card)
    return ["runs/standing", "runs/trotting"]


@pytest.fixture(autouse=True)
def short(monkeypatch: pytest.MonkeyPatch) -> None:
    """A crossing ends soon, finished or not."""
    monkeypatch.setattr("vinl.courses.crossing.PATIENCE", 0.05)


def test_bars_write_the_names_that_others_read(policies: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    command = f"eval-loco --policy {policies[0]} --terrain bars --height 0.05 0.1 --crossings 2 --workers 1 --out bars"
    assert main(command.split()) == 0
    data = json.loads(Path("bars/results.json").read_text())
    figures = data["aggregate"]
    for name in ("clean_foot_crossings", "clean_crossings", "finished", "falls", "foot_steps_per_crossing"):
        assert figures[name] == 0 and len(figures["ci95"][name]) == 2
    assert {"leg_steps_per_crossing", "cost_of_transport", "joint_overspeed", "foot_distance_min"} <= figures.keys()
    assert list(figures["by_height"]) == ["0.05", "0.1"]
    assert [(c["height"], c["crossing"]) for c in data["crossings"]] == [(0.05, 0), (0.05, 1), (0.1, 0), (0.1, 1)]
    assert data["config"]["depth"] == 0.2 and data["config"]["speed"] == 0.5
    said = capsys.readouterr().out
    assert "standing" in said and "no foot" in said and "results.json" in said and "2 crossings each" in said
    assert main(command.replace("0.1", "0.15").split()) == 2  # what another command found stays
    assert f"holds the results of 'vinl eval-loco --policy {policies[0]}" in capsys.readouterr().err
    assert json.loads(Path("bars/results.json").read_text()) == data


def test_results_of_another_command_stay_where_they_are() -> None:
    folder = Path("runs/eval-loco-loco")
    write_json(folder / "results.json", {"command": ["vinl", "eval-loco"]})
    assert choose_out(None, folder, ["vinl", "eval-loco"]) == folder
    assert choose_out(None, folder, ["vinl", "eval-loco", "--seed", "1"]) == Path("runs/eval-loco-loco-2")


def test_policies_are_compared_over_bars_and_filmed(
    policies: list[str], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("vinl.courses.crossing_pictures.SIZE", (64, 32))
    command = f"eval-loco --compare {' '.join(policies)} --terrain bars --crossings 1 --workers 1 --video --out both"
    assert main(command.split()) == 0
    assert "1 crossing each" in capsys.readouterr().out
    data = json.loads(Path("both/results.json").read_text())
    assert list(data["compared"]) == ["standing", "trotting"]
    assert all("clean_crossings" in one["aggregate"] for one in data["compared"].values())
    assert {c["policy"] for c in data["crossings"]} == {"standing", "trotting"}
    assert {p.name for p in Path("both").iterdir()} == {"results.json", "bar_10cm.mp4", "bar_10cm.png"}


def test_litter_is_compared_by_dirty_steps(policies: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    command = f"eval-loco --compare {' '.join(policies)} --terrain litter --robots 1 --seconds 0.2 --workers 1 --out l"
    assert main(command.split()) == 0
    data = json.loads(Path("l/results.json").read_text())
    assert all("dirty_steps" in one["aggregate"] for one in data["compared"].values())
    assert data["config"]["commands"]["forward"] == [0.4, 0.4]
    said = capsys.readouterr().out
    assert "steps %" in said and "dirty: foot or leg touched an object" in said


@pytest.mark.parametrize(
    ("width", "titles"),
    [
        (80, "policy blocks/m feet feet blocks/m m/s rad/s over fell"),
        (60, "policy blocks/m blocks/m m/s rad/s fell"),
    ],
)
def test_a_comparison_names_its_columns_and_fits(width: int, titles: str) -> None:
    names = ("rough", "no_pretraining")
    figures = {key: 1.234 for key, _, _ in (*report._COLUMNS, *((key, 0, 0) for key, *_ in report._GAIT))}
    by_height = dict.fromkeys(HEIGHT_NAMES, 1.234)
    heights = {f"{limb}_block_per_m_by_height": by_height for limb in ("foot", "leg")}
    ci95 = {"foot_block_per_m": (1.1, 1.3), "leg_block_per_m": (1.1, 1.3)}
    results = TrialResults(
        [], {**figures, **heights, "falls": 0.1, "ci95": ci95}, {}, {"ground": {"terrain": "blocks"}}, 0.0
    )
    said = io.StringIO()
    report.print_comparison(Console(width=width, file=said), dict.fromkeys(names, results))
    lines = said.getvalue().splitlines()
    head = next(k for k, line in enumerate(lines) if line.startswith(" policy"))
    assert lines[head].split() == titles.split() and "error" in lines[head - 1] and "speed" in lines[head - 2]
    assert said.getvalue().count(" no_pretraining ") == 4 and "…" not in said.getvalue()


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ("--terrain bars --height 0", "--height must lie"),
        ("--terrain bars --height 0.1 0.1", "different heights"),
        ("--terrain bars --depth 3", "--depth must lie"),
        ("--terrain bars --speed 9", "--speed must lie"),
        ("--terrain bars --crossings 0", "--crossings must lie"),
        ("--terrain bars --robots 3", "--robots is not for --terrain bars"),
        ("--terrain bars --commands home", "--commands is not for --terrain bars"),
        ("--terrain blocks --height 0.1", "--height is for --terrain bars alone"),
        ("--terrain litter --speed 0.4", "--speed is for --terrain bars alone"),
        ("--video", "--video is for --terrain bars alone"),
        ("--terrain litter --density 99", "--density must lie between 0 and 30"),
        ("--terrain swamp", "litter"),
        ("--robots 0", "--robots must lie"),
    ],
)
def test_bad_input_is_one_line(
    options: str, words: str, policies: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["eval-loco", "--policy", policies[0], "--out", "a", *options.split()]) == 2
    error = capsys.readouterr().err
    assert error.startswith("error: ") and error.count("\n") == 1 and words in error
    assert not Path("a").exists()
