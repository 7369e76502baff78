"""The command line's frame: help, version, unknown commands, bad input as one line with exit code 2."""

import subprocess
import sys
import time
from pathlib import Path
from types import SimpleNamespace

import pytest

from vinl.cli import app
from vinl.config.errors import InputError


def plant(monkeypatch: pytest.MonkeyPatch, outcome: object) -> None:
    """A command ``trial`` that raises the outcome if it is an exception, else returns it."""

    def run(argv: list[str]) -> object:
        if isinstance(outcome, BaseException):
            raise outcome
        return outcome

    monkeypatch.setitem(sys.modules, "trial_command", SimpleNamespace(main=run))  # type: ignore[arg-type]
    monkeypatch.setitem(app.COMMANDS, "trial", ("trial_command", "for the test"))


@pytest.mark.parametrize("argv", [[], ["--help"], ["-h"], ["help"]])
def test_help_names_every_command(argv: list[str], capsys: pytest.CaptureFixture[str]):
    assert app.main(argv) == 0
    said = capsys.readouterr().out
    assert all(f"\n  {command} " in said for command in app.COMMANDS)


def test_version(capsys: pytest.CaptureFixture[str]):
    assert app.main(["--version"]) == 0
    assert capsys.readouterr().out.startswith("vinl 0.")


def test_the_package_runs_as_the_command():
    done = subprocess.run([sys.executable, "-m", "vinl", "--version"], capture_output=True, text=True, check=True)
    assert done.stdout.startswith("vinl 0.")


def test_unknown_command_suggests_the_nearest(capsys: pytest.CaptureFixture[str]):
    assert app.main(["policy"]) == 2
    assert (
        capsys.readouterr().err == "error: unknown command 'policy', did you mean 'policies'? (vinl --help lists all)\n"
    )
    assert app.main(["xyzzy"]) == 2
    assert "did you mean" not in capsys.readouterr().err


@pytest.mark.parametrize(
    ("outcome", "code", "said"),
    [
        (None, 0, ""),
        (1, 1, ""),
        (InputError("plan.png is\nempty"), 2, "error: plan.png is empty\n"),
        (KeyboardInterrupt(), 130, "interrupted\n"),
        (ModuleNotFoundError("x", name="jax.numpy"), 2, 'install it: pip install "vinl[train]"\n'),
        (ModuleNotFoundError("x", name="mujoco.mjx"), 2, 'install it: pip install "vinl[train]"\n'),
        (PermissionError(13, "Permission denied", "/out"), 2, "error: /out: Permission denied; "),
    ],
)
def test_how_commands_end(
    outcome: object, code: int, said: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    plant(monkeypatch, outcome)
    assert app.main(["trial"]) == code
    spoken = capsys.readouterr().err
    assert said in spoken and spoken.count("\n") == (1 if said else 0)


@pytest.mark.parametrize(
    "fault", [ValueError("ours"), ModuleNotFoundError("x", name="vinl.oops"), FileNotFoundError(2, "gone", "x")]
)
def test_our_own_faults_keep_their_traceback(fault: Exception, monkeypatch: pytest.MonkeyPatch):
    plant(monkeypatch, fault)
    with pytest.raises(type(fault)):
        app.main(["trial"])


def test_help_is_quick_and_imports_nothing_heavy():
    heavy = ["torch", "jax", "warp", "mujoco", "numpy", "tyro", "rich"]
    code = f"import sys; from vinl.cli.app import main; main(['--help']); print(*set({heavy}) & set(sys.modules))"
    start = time.perf_counter()
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert time.perf_counter() - start < 0.5 + 1.0  # the half second, and a second for a busy machine
    assert run.stdout.splitlines()[-1] == ""


def test_a_closed_pipe_is_no_error(tmp_path: Path):
    command = f"{sys.executable} -m vinl.cli.app policies --json | true; echo ${{PIPESTATUS[0]}}"
    run = subprocess.run(["bash", "-c", command], capture_output=True, text=True)
    assert run.stderr == "" and run.stdout.strip() == "0"
