"""What ``vinl play`` refuses, in one line each, before anything is loaded."""

import socket
import subprocess
import sys

import pytest

from vinl.cli.app import main


def refusal(capsys: pytest.CaptureFixture[str], *argv: str) -> str:
    """The one line on standard error."""
    assert main(["play", *argv]) == 2
    said = capsys.readouterr().err
    assert said.startswith("error: ") and said.count("\n") == 1
    return said


@pytest.mark.parametrize(
    ("argv", "words"),
    [
        ("--plan harbour_flt", "harbour_flat"),
        ("--plan harbour_flat --terrain flat", "--plan and --terrain do not go together"),
        ("--terrain bar", "did you mean 'bars'"),
        ("--terrain blocks --density 9", "--density"),
        ("--policy roug", "did you mean 'rough'"),
        ("--loco nav", "locomotion policy"),
        ("--nav orcale", "did you mean 'oracle'"),
        ("--obstacles papr", "did you mean 'paper'"),
        ("--seed -1", "--seed must not be negative"),
        ("--pace 0", "pace"),
        ("--port 70000", "--port must lie between 0 and 65535"),
        ("--replay nowhere", "vinl eval --record"),
        ("--replay . --loco rough", "--replay shows what was recorded"),
        ("--replay . --sensors realistic", "takes no --sensors"),
        ("--replay . --config eval/default", "takes no --sensors, --drift, --config"),
        ("--replay . --seed 3", "--replay shows what was recorded"),
        ("--sensors realistc", "did you mean 'realistic'"),
        ("faults.action_delay=0.5s", "faults.action_delay=0.5s"),
        ("--config loco/rough", "is a config of locomotion"),
        ("--prot 80", "--port"),
    ],
)
def test_refusals(capsys: pytest.CaptureFixture[str], argv: str, words: str):
    assert words in refusal(capsys, *argv.split())


def test_busy_port(capsys: pytest.CaptureFixture[str]):
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = str(taken.getsockname()[1])
        said = refusal(capsys, "--terrain", "flat", "--policy", "rough", "--port", port)
    assert f"--port {port}" in said and "Address already in use" in said


def test_missing_extra_is_named():
    code = (
        "import sys, importlib.util as u; find = u.find_spec\n"
        "u.find_spec = lambda name, *rest: None if name == 'viser' else find(name, *rest)\n"
        "from vinl.cli.app import main; sys.exit(main(['play', '--terrain', 'flat']))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 2 and done.stderr.count("\n") == 1
    assert 'pip install "vinl[viewer]"' in done.stderr


def test_help_has_units_and_defaults(capsys: pytest.CaptureFixture[str]):
    with pytest.raises(SystemExit) as end:
        main(["play", "--help"])
    said = capsys.readouterr().out
    assert end.value.code in (0, None)
    for words in ("--port", "8080", "127.0.0.1", "blocks per m2", "1 is real time", "--policy", "--replay"):
        assert words in said
