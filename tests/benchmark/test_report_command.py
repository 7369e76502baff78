"""``vinl report``: a folder is drawn again, folders of several robots become a table, bad input is refused."""

import json
import shutil
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest

from vinl.cli.app import main
from vinl.policies.io import save_policy
from vinl.policies.policy import LocomotionPolicy

COMMON = "--nav oracle --floorplans harbour_flat old_town --episodes 2 --seeds 2 --workers 1 --set time_limit=0.3"


def read(folder: str | Path) -> dict:
    data = json.loads((Path(folder) / "results.json").read_text())
    del data["timing"], data["aggregate"]["wall_seconds"]
    return data


def run(words: str) -> int:
    return main(words.split())


@pytest.fixture(scope="module")
def walked(standing: LocomotionPolicy, trotting: LocomotionPolicy, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two robots in the same episodes."""
    folder = tmp_path_factory.mktemp("walked")
    for policy in (standing, trotting):
        path, name = folder / "policies" / policy.card.name, policy.card.name
        save_policy(path, policy.network, policy.card)
        assert run(f"eval --loco {path} --obstacles paper {COMMON} --out {folder / name}") == 0
    return folder


def test_the_report_is_drawn_again_in_place(walked: Path, tmp_path: Path) -> None:
    folder = shutil.copytree(walked / "trotting", tmp_path / "copy")
    before = read(folder)
    (folder / "report.html").unlink()
    (folder / "results.json").unlink()
    assert main(["report", str(folder)]) == 0
    assert read(folder) == before
    page = (folder / "report.html").read_text().replace("<!DOCTYPE html>\n", "")
    assert sum(e.get("class", "").startswith("ep ") for e in ET.fromstring(page).iter()) == 8


def test_folders_of_different_robots_become_a_table(walked: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folders = [str(walked / name) for name in ("standing", "trotting")]
    assert main(["report", *folders, "--out", "both", "--reference", "trotting-oracle-paper"]) == 0
    data = json.loads(Path("both/results.json").read_text())
    assert list(data["rows"]) == ["standing-oracle-paper", "trotting-oracle-paper"]
    (compared,) = data["comparisons"]
    assert compared["episodes"] == 8 and compared["same_clutter"]
    assert read("both/trotting-oracle-paper") == read(walked / "trotting")
    capsys.readouterr()
    assert main(["report", *folders, "--out", "x", "--reference", "troting-oracle-paper"]) == 2
    assert "did you mean 'trotting-oracle-paper'" in capsys.readouterr().err


def test_what_does_not_fit_is_one_line(walked: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    one, policy = walked / "trotting", walked / "policies" / "standing"
    other = tmp_path / "other"
    assert run(f"eval --loco {policy} --obstacles paper {COMMON} --set time_limit=0.2 --out {other}") == 0
    double = shutil.copytree(one, tmp_path / "double")
    cut = shutil.copytree(one, tmp_path / "cut")
    lines = (cut / "episodes.jsonl").read_bytes().splitlines(keepends=True)
    (cut / "episodes.jsonl").write_bytes(b"".join(lines[:-1]))
    capsys.readouterr()
    for folders, words in (
        ([cut], "1 of 8 episodes are missing"),
        ([cut], "the run was interrupted, start its command again"),
        ([one, double], "hold the same robot in the same clutter"),
        ([one, other], "do not belong together: config.evaluation.time_limit is 0.3"),
        ([one, one], "given twice"),
        ([tmp_path], "no folder of vinl eval"),
        ([], ""),
    ):
        assert main(["report", *map(str, folders), "--out", "merged"]) == 2
        error = capsys.readouterr().err
        assert error.startswith("error: ") and error.count("\n") == 1 and words in error
        assert not Path("merged").exists()
