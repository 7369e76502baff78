"""``vinl eval --shard`` and ``vinl report``: shares put together are the whole; what does not fit is refused."""

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
def walked(trotting: LocomotionPolicy, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Three shares and the whole of the same evaluation."""
    folder = tmp_path_factory.mktemp("walked")
    policy = save_policy(folder / "policy", trotting.network, trotting.card)
    for name, more in (("whole", ""), *((f"part{k}", f"--shard {k}/3") for k in (1, 2, 3))):
        assert run(f"eval --loco {policy} --obstacles paper {COMMON} --out {folder / name} {more}") == 0
    return folder


def test_shares_together_are_the_whole(walked: Path) -> None:
    parts = [str(walked / f"part{k}") for k in (3, 1, 2)]
    assert main(["report", *parts, "--out", "merged"]) == 0
    assert read("merged") == read(walked / "whole")
    sizes = [len(read(part)["episodes"]) for part in parts]
    assert sizes == [2, 3, 3] and read(parts[0])["shard"] == "3/3"
    page = Path("merged/report.html").read_text().replace("<!DOCTYPE html>\n", "")
    assert sum(e.get("class", "").startswith("ep ") for e in ET.fromstring(page).iter()) == 8


def test_the_report_is_drawn_again_in_place(walked: Path, tmp_path: Path) -> None:
    folder = shutil.copytree(walked / "whole", tmp_path / "copy")
    before = read(folder)
    (folder / "report.html").unlink()
    (folder / "results.json").unlink()
    assert main(["report", str(folder), "--out", str(folder)]) == 0
    assert read(folder) == before and (folder / "report.html").exists()


def test_what_does_not_fit_is_one_line(walked: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    other = tmp_path / "other"
    policy = walked / "policy"
    assert run(f"eval --loco {policy} --obstacles paper {COMMON} --set time_limit=0.2 --out {other} --shard 3/3") == 0
    double = shutil.copytree(walked / "part1", tmp_path / "double")
    cut = shutil.copytree(walked / "part3", tmp_path / "cut")
    lines = (cut / "episodes.jsonl").read_bytes().splitlines(keepends=True)
    (cut / "episodes.jsonl").write_bytes(b"".join(lines[:-1]))
    capsys.readouterr()
    one, two, three = (walked / f"part{k}" for k in (1, 2, 3))
    for folders, words in (
        ([one, two], "2 of 8 episodes are missing"),
        ([one, two], "give the folder of --shard 3/3 too"),
        ([one, two, three, double], "both hold episode 0 of seed 1 in old_town; give each share once"),
        ([one, two, cut], "a run was interrupted: start its command again"),
        ([one, two, other], "do not belong together: config.evaluation.time_limit is 0.3"),
        ([one, one], "given twice"),
        ([tmp_path], "no folder of vinl eval"),
        ([], ""),
    ):
        assert main(["report", *map(str, folders), "--out", "merged"]) == 2
        error = capsys.readouterr().err
        assert error.startswith("error: ") and error.count("\n") == 1 and words in error
        assert not Path("merged").exists()


def test_folders_of_different_robots_become_a_table(
    walked: Path, standing: LocomotionPolicy, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    policy = save_policy(tmp_path / "standing", standing.network, standing.card)
    assert run(f"eval --loco {policy} --obstacles paper {COMMON} --out {tmp_path / 'still'}") == 0
    parts = [str(walked / f"part{k}") for k in (1, 2, 3)]
    assert (
        main(["report", str(tmp_path / "still"), *parts, "--out", "both", "--reference", "trotting-oracle-paper"]) == 0
    )
    data = json.loads(Path("both/results.json").read_text())
    assert list(data["rows"]) == ["standing-oracle-paper", "trotting-oracle-paper"]
    (compared,) = data["comparisons"]
    assert compared["episodes"] == 8 and compared["same_clutter"]
    assert read("both/trotting-oracle-paper") == read(walked / "whole")
    capsys.readouterr()
    assert main(["report", str(tmp_path / "still"), *parts, "--out", "x", "--reference", "troting-oracle-paper"]) == 2
    assert "did you mean 'trotting-oracle-paper'" in capsys.readouterr().err
