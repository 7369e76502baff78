"""The command line: picks the command, turns bad input into one line. Imports nothing heavy by itself."""

from __future__ import annotations

import errno
import importlib
import os
import sys

from vinl.config.errors import InputError

COMMANDS = {
    "eval": ("vinl.cli.eval", "the whole chain in MuJoCo: a robot crosses floor plans; report, figures, video"),
    "report": ("vinl.cli.report", "draw the report of a folder again, or of several side by side"),
    "eval-loco": ("vinl.cli.eval_loco", "a locomotion policy alone in MuJoCo: bars, litter, random commands"),
    "eval-nav": ("vinl.cli.eval_nav", "a navigation policy alone, in homes that it has never seen"),
    "train-loco": ("vinl.cli.train_loco", "train a locomotion policy (needs the train extra)"),
    "play": (
        "vinl.cli.play",
        "watch and drive the robot in the browser, or scrub a recording (needs the viewer extra)",
    ),
    "replay-nan": ("vinl.cli.replay_nan", "look again at a robot whose numbers went wrong in a training (train extra)"),
    "train-nav": ("vinl.cli.train_nav", "train a navigation policy (needs the train extra)"),
    "plans": ("vinl.cli.plans", "list the shipped floor plans, draw a floor plan"),
    "policies": ("vinl.cli.policies", "the trained policies that come with vinl, and their measured figures"),
    "export": ("vinl.cli.export", "a policy as an ONNX file for a robot, checked in MuJoCo C; a home as MJCF"),
    "bench": ("vinl.cli.bench", "how fast training physics and the depth camera run here"),
    "doctor": ("vinl.cli.doctor", "versions, devices, and a one-second check of each part"),
}
"""Command to its module, whose ``main(argv)`` runs it, and its line in the help."""

TRAIN_MODULES = {"jax", "jaxlib", "rsl_rl", "gymnasium", "tensorboard", "tensordict"}
"""Top-level modules that only the train extra installs; ``mujoco.mjx`` is the one more, inside ``mujoco``."""

TRAIN_HINT = 'pip install "vinl[train]"'


def main(argv: list[str] | None = None) -> int:
    """Run a command and return its exit code: 0 well, 1 a check failed, 2 bad input, 130 interrupted."""
    argv = sys.argv[1:] if argv is None else argv
    if not argv or argv[0] in ("-h", "--help", "help"):
        print(_help())
        return 0
    if argv[0] in ("-V", "--version"):
        from importlib.metadata import version

        print(f"vinl {version('vinl')}")
        return 0
    try:
        return _run(argv[0], argv[1:])
    except InputError as error:
        return _fail(str(error))
    except ModuleNotFoundError as error:
        name = error.name or ""
        if name.split(".")[0] in TRAIN_MODULES or name.startswith("mujoco.mjx"):
            return _fail(f"vinl {argv[0]} needs {name}, which only training uses; install it: {TRAIN_HINT}")
        raise
    except BrokenPipeError:  # the reader (head, less) has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except OSError as error:
        if error.errno in _FULL:
            where = f"{error.filename}: " if error.filename else ""
            return _fail(f"{where}{error.strerror}; make room, or choose another place with --out")
        if error.filename is None or error.errno not in _USERS_ERRNO:
            raise
        return _fail(f"{error.filename}: {error.strerror}; choose another path")
    except KeyboardInterrupt:
        print("interrupted", file=sys.stderr)
        return 130


_FULL = {errno.ENOSPC, errno.EDQUOT, errno.EFBIG}
"""No room on the disk, or not for this user, or not in one file."""

_USERS_ERRNO = {errno.EACCES, errno.EPERM, errno.EROFS, errno.ENOTDIR, errno.EISDIR, errno.ENAMETOOLONG}
"""What goes wrong with a path that the user chose; anything else is a fault of ours and keeps its traceback."""


def _run(command: str, argv: list[str]) -> int:
    if command not in COMMANDS:
        import difflib

        near = difflib.get_close_matches(command, COMMANDS, n=1, cutoff=0.4)
        meant = f", did you mean {near[0]!r}?" if near else ""
        raise InputError(f"unknown command {command!r}{meant} (vinl --help lists all)")
    module = importlib.import_module(COMMANDS[command][0])
    return module.main(argv) or 0


def _fail(message: str) -> int:
    print(f"error: {' '.join(message.splitlines())}", file=sys.stderr)
    return 2


def _help() -> str:
    rows = "\n".join(f"  {name:<12}{summary}" for name, (_, summary) in COMMANDS.items())
    return f"""usage: vinl COMMAND [OPTIONS]

A legged robot crosses cluttered homes it has never seen, from depth images: training and evaluation on MuJoCo.

commands:
{rows}

options:
  -h, --help    this text; vinl COMMAND --help explains a command
  --version     the version

try: vinl eval --floorplans harbour_flat --episodes 2 --seeds 1 --video"""


if __name__ == "__main__":
    sys.exit(main())
