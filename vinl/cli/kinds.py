"""Configs and runs of the other training: one line that says where they belong."""

from __future__ import annotations

import json
from pathlib import Path

from vinl.config.errors import InputError
from vinl.policies.card import read_card
from vinl.policies.io import find_policy
from vinl.rl.run_folder import METRICS, RunFolder

COMMANDS = {"locomotion": "vinl train-loco", "navigation": "vinl train-nav"}
"""Kind of policy to the command that trains it."""

_FOLDERS = {"loco": "locomotion", "nav": "navigation", "eval": "evaluation", "sensors": "depth cameras"}


def check_config(name: str, kind: str) -> None:
    """Refuse a shipped config of another kind.

    Raises:
        InputError: it is one.
    """
    found = _FOLDERS.get(name.removeprefix("configs/").split("/")[0], kind) if "/" in name else kind
    if found != kind:
        instead = f": use {COMMANDS[found]} --config {name}" if found in COMMANDS else ""
        raise InputError(f"--config {name} is a config of {found}, not of {kind}{instead}")


def check_source(name: str, kind: str) -> None:
    """Refuse to start from a policy of the other kind.

    Raises:
        InputError: it is one, or there is none.
    """
    card = read_card(find_policy(name))
    if card.kind != kind:
        raise InputError(f"--from {name} is a {card.kind} policy: use {COMMANDS[card.kind]}")


def check_run(folder: str, kind: str, iterations: int | None) -> None:
    """Refuse to resume a run of the other kind, or one that has all the iterations that are asked for.

    Raises:
        InputError: it is one, or no run.
    """
    run = RunFolder(folder)
    found = "navigation" if "homes" in run.open() else "locomotion"
    if found != kind:
        raise InputError(f"{folder} is a {found} run: use {COMMANDS[found]} --resume {folder}")
    done = count_iterations(run.path)
    if iterations is not None and done >= iterations:
        raise InputError(f"{folder} already has {done} iterations; give more with --iterations")


def count_iterations(folder: Path) -> int:
    """Of a run, by its curves; 0 without any."""
    file = folder / METRICS
    lines = file.read_text(encoding="utf-8").splitlines() if file.is_file() else []
    for line in reversed(lines):
        try:
            return int(json.loads(line)["iteration"])
        except (ValueError, KeyError, TypeError):  # a line that a kill cut off
            continue
    return 0
