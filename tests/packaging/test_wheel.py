"""The wheel carries all that evaluating needs, and runs in an empty environment without the training libraries.

It is built from the sdist, as whoever installs from the sdist does; ``make release`` has it tried on what it has built.
"""

import json
import os
import subprocess
import sys
import tarfile
import venv
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
pytestmark = [pytest.mark.slow, pytest.mark.timeout(900)]


@pytest.fixture(scope="module")
def dist(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder with both."""
    if "VINL_DIST" in os.environ:
        return ROOT / os.environ["VINL_DIST"]
    out = tmp_path_factory.mktemp("dist")
    command = [sys.executable, "-m", "build", "--no-isolation", "--outdir", str(out), str(ROOT)]
    subprocess.run(command, check=True, capture_output=True)
    return out


@pytest.fixture(scope="module")
def wheel(dist: Path) -> Path:
    (built,) = dist.glob("vinl-*.whl")
    return built


def test_sdist_carries_the_sources(dist: Path):
    (built,) = dist.glob("vinl-*.tar.gz")
    with tarfile.open(built) as archive:
        inside = {name.split("/", 1)[1] for name in archive.getnames() if "/" in name}
    assert {
        "pyproject.toml",
        "README.md",
        "LICENSE",
        "Makefile",
        "vinl/cli/app.py",
        "configs/nav/default.yaml",
    } <= inside
    assert {"assets/policies/rough/policy.safetensors", "examples/deploy/walk_home.py", "docs/deploy.md"} <= inside
    assert not [name for name in inside if name.split("/")[0] in (".venv", "runs", "dist", ".git")]


def test_wheel_carries_configs_assets_and_weights(wheel: Path):
    inside = set(zipfile.ZipFile(wheel).namelist())
    for folder in ("assets", "configs"):
        files = [p for p in (ROOT / folder).rglob("*") if p.is_file() and not p.name.startswith(".")]
        missing = {f"vinl/{p.relative_to(ROOT)}" for p in files} - inside
        assert files and not missing
    assert {"vinl/configs/loco/rough.yaml", "vinl/assets/aliengo/aliengo.xml"} <= inside
    assert {f"vinl/assets/policies/rough/{name}" for name in ("card.json", "policy.safetensors")} <= inside
    assert not [name for name in inside if name.split("/")[0] in ("tests", "scripts", "docs", "notebooks", "typings")]


@pytest.fixture(scope="module")
def environment(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """``bin`` of a fresh environment with the wheel and its dependencies, without the train extra."""
    folder = tmp_path_factory.mktemp("environment")
    venv.create(folder)  # pip comes from outside: to install it takes as long as many a package
    pip = [sys.executable, "-m", "pip", "--python", str(folder / "bin" / "python")]
    for packages in (["torch==2.13.*"], [str(wheel)]):
        install = [*pip, "install", "--quiet", "--no-compile", *packages]  # as needed is sooner
        done = subprocess.run(install, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
    return folder / "bin"


def run(environment: Path, *argv: str) -> subprocess.CompletedProcess[str]:
    """``vinl`` of that environment; the checkout is nowhere on its path."""
    clean = {k: v for k, v in os.environ.items() if not k.startswith(("PYTHON", "JAX", "XLA", "VIRTUAL_ENV"))}
    return subprocess.run([str(environment / "vinl"), *argv], capture_output=True, text=True, env=clean, timeout=240)


def test_environment_has_no_training_library(environment: Path):
    code = "from importlib.util import find_spec as f; print([m for m in ('jax', 'rsl_rl', 'gymnasium') if f(m)])"
    said = subprocess.run([str(environment / "python"), "-c", code], capture_output=True, text=True, check=True)
    assert said.stdout.strip() == "[]"


def test_training_says_what_to_install(environment: Path):
    done = run(environment, "train-loco", "--stage", "1", "--device", "cpu")
    assert done.returncode == 2 and done.stderr.count("\n") == 1
    assert 'pip install "vinl[train]"' in done.stderr
    assert not Path("runs").exists()


def test_export_says_what_to_install(environment: Path):
    done = run(environment, "export", "loco")
    assert done.returncode == 2 and done.stderr.count("\n") == 1
    assert 'pip install "vinl[export]"' in done.stderr


def test_doctor_is_content(environment: Path):
    done = run(environment, "doctor", "--json")
    assert done.returncode == 0, done.stdout + done.stderr
    states = {check["part"]: check["state"] for check in json.loads(done.stdout)["checks"]}
    assert states.pop("training") == "not installed"
    assert set(states.values()) == {"ok"}


def test_two_episodes(environment: Path):
    listed = subprocess.run(
        [str(environment / "python"), "-c", "import vinl; print(vinl.shipped_floorplans()[0])"],
        capture_output=True,
        text=True,
        check=True,
    )
    options = f"--floorplans {listed.stdout.strip()} --loco rough --nav oracle --episodes 2 --seeds 1 --obstacles none"
    done = run(environment, "eval", *options.split(), "--out", "out")
    assert done.returncode == 0, done.stderr
    results = json.loads(Path("out/results.json").read_text())
    assert len(results["episodes"]) == 2
    assert results["aggregate"]["success"]["mean"] > 0
