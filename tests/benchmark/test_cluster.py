"""``vinl eval --cluster``: bit for bit what worker processes of one machine find; bad input is one line."""

import json
import socket
import sys
from pathlib import Path

import pytest

from vinl.cli.app import main

WORDS = (
    "eval --floorplans harbour_flat --loco loco --nav nav --obstacles paper --episodes 2 --seeds 2 --record "
    "--set time_limit=0.6 --workers"
)
OPTIONS = WORDS.split()


def read(folder: str) -> tuple[dict, list[str], dict[str, bytes]]:
    """Results without times, every episode without when it was written, and the recordings."""
    data = json.loads(Path(folder, "results.json").read_text())
    del data["timing"], data["aggregate"]["wall_seconds"]
    lines = [json.loads(line) for line in Path(folder, "episodes.jsonl").read_text().splitlines()]
    episodes = sorted(json.dumps([line["record"], line["trace"]]) for line in lines if "record" in line)
    return data, episodes, {path.name: path.read_bytes() for path in Path(folder, "recordings").iterdir()}


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")  # Ray's own
def test_a_local_cluster_of_two_workers() -> None:
    pytest.importorskip("ray", reason="the cluster extra is not installed")
    assert main([*OPTIONS, "2", "--cluster", "local", "--out", "cluster"]) == 0
    assert main([*OPTIONS, "1", "--out", "here"]) == 0
    assert read("cluster") == read("here")


def test_no_cluster_is_one_line(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    cases = [(f"{kind}127.0.0.1:{port}", "cannot be reached (Connection refused)") for kind in ("", "ray://")]
    for address, words in [*cases, ("local", 'pip install "vinl[cluster]"')]:
        if address == "local":
            monkeypatch.setitem(sys.modules, "ray", None)
        assert main([*OPTIONS, "1", "--cluster", address, "--out", "x"]) == 2
        error = capsys.readouterr().err
        assert error.startswith("error: ") and error.count("\n") == 1 and words in error
    assert not Path("x").exists()
