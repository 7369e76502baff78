"""The import contracts hold, and a planted import against them is caught."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


def lint(folder: Path) -> subprocess.CompletedProcess[str]:
    command = [str(Path(sys.executable).parent / "lint-imports"), "--no-cache"]
    environment = {**os.environ, "PYTHONPATH": str(folder)}
    return subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True)


@pytest.fixture
def copy(tmp_path: Path) -> Path:
    shutil.copytree(ROOT / "vinl", tmp_path / "vinl", ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(ROOT / "pyproject.toml", tmp_path)
    return tmp_path


def test_arrows_hold(copy: Path):
    run = lint(copy)
    assert run.returncode == 0, run.stdout


@pytest.mark.parametrize(
    ("module", "line", "contract"),
    [
        ("nav/planted.py", "from vinl import loco", "arrows point one way"),
        ("loco/planted.py", "def late():\n    import vinl.nav", "arrows point one way"),
        ("world/planted.py", "import vinl.robot.aliengo", "arrows point one way"),
        ("sensing/planted.py", "import vinl.policies.card", "arrows point one way"),
        ("world/planted.py", "import torch", "the world knows no simulator"),
        ("chain/planted.py", "import jax", "evaluating needs no training library"),
    ],
)
def test_planted_import_is_caught(module: str, line: str, contract: str, copy: Path):
    (copy / "vinl" / module).write_text(line + "\n")
    run = lint(copy)
    assert run.returncode == 1
    broken = [said for said in run.stdout.splitlines() if said.endswith("BROKEN")]
    assert len(broken) == 1 and contract in broken[0]
