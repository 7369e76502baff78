"""A run killed with SIGKILL and started again ends with the results of a run that was left alone, whatever the number
of workers."""

import json
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from vinl.cli.app import main

WORDS = (
    "--floorplans harbour_flat --loco teacher --nav oracle --obstacles paper --episodes 3 --seeds 2 --set time_limit=4"
)
OPTIONS = WORDS.split()


def read(folder: str) -> dict:
    data = json.loads((Path(folder) / "results.json").read_text())
    del data["timing"], data["aggregate"]["wall_seconds"]
    return data


@pytest.mark.slow
def test_killed_and_started_again() -> None:
    argv = ["eval", *OPTIONS, "--out", "killed", "--workers"]
    process = subprocess.Popen([sys.executable, "-m", "vinl.cli.app", *argv, "2"], stdout=subprocess.DEVNULL)
    episodes, until = Path("killed/episodes.jsonl"), time.monotonic() + 60
    while process.poll() is None and time.monotonic() < until:
        if episodes.exists() and episodes.read_bytes().count(b"\n") >= 3:  # the session and two episodes
            break
        time.sleep(0.002)
    children = Path(f"/proc/{process.pid}/task/{process.pid}/children")  # Linux alone lists them
    workers = [Path("/proc", child) for child in children.read_text().split()] if children.exists() else []
    process.send_signal(signal.SIGKILL)
    process.wait()
    until = time.monotonic() + 60
    while any(worker.exists() for worker in workers) and time.monotonic() < until:
        time.sleep(0.1)
    assert not any(worker.exists() for worker in workers)  # they do not walk on for nobody
    kept = episodes.read_bytes()
    assert 2 <= kept.count(b'"record"') < 6
    assert not Path("killed/results.json").exists()
    assert main([*argv, "1"]) == 0
    assert episodes.read_bytes().startswith(kept[: kept.rfind(b"\n") + 1])  # what was there stays
    assert main(["eval", *OPTIONS, "--workers", "1", "--out", "whole"]) == 0
    assert read("killed") == read("whole")
