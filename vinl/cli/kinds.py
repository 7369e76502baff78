"""Configs and runs of the other training: one line that says where they belong."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from vinl.config.errors import InputError
from vinl.config.loader import closest

if TYPE_CHECKING:
    from vinl.chain.config import EvaluationConfig

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


def load_rules(config: str, overrides: Sequence[str], sensors: str | None, drift: float | None) -> EvaluationConfig:
    """The rules of episodes of the chain.

    Args:
        config: a shipped config or a YAML file.
        overrides: settings as ``key=value``.
        sensors: errors of the depth cameras: a shipped group's name, or a YAML file; None: as in the config.
        drift: of the odometry, a fraction; None: as in the config.

    Raises:
        InputError: a config of another kind, or a setting that is none.
    """
    from vinl.chain.config import EvaluationConfig
    from vinl.config.loader import list_configs, load_config

    check_config(config, "evaluation")
    errors = []
    if sensors is not None:
        groups = [name.removeprefix("sensors/") for name in list_configs() if name.startswith("sensors/")]
        is_file = sensors.endswith((".yaml", ".yml"))
        if not is_file and sensors not in groups:
            raise InputError(f"--sensors {sensors!r} is unknown{closest(sensors, groups)}; known: {', '.join(groups)}")
        errors.append(f"sensors={sensors if is_file else f'sensors/{sensors}'}")
    if drift is not None:
        errors.append(f"odometry.drift=[{drift},{drift}]")
    return load_config(EvaluationConfig, config, [*errors, *overrides])


def check_source(name: str, kind: str) -> None:
    """Refuse to start from a policy of the other kind.

    Raises:
        InputError: it is one, or there is none.
    """
    from vinl.policies.card import read_card
    from vinl.policies.io import find_policy

    card = read_card(find_policy(name))
    if card.kind != kind:
        raise InputError(f"--from {name} is a {card.kind} policy: use {COMMANDS[card.kind]}")


def check_run(folder: str, kind: str, iterations: int | None) -> None:
    """Refuse to resume a run of the other kind, or one that has all the iterations that are asked for.

    Raises:
        InputError: it is one, or no run.
    """
    from vinl.rl.run_folder import RunFolder

    run = RunFolder(folder)
    found = "navigation" if "homes" in run.open() else "locomotion"
    if found != kind:
        raise InputError(f"{folder} is a {found} run: use {COMMANDS[found]} --resume {folder}")
    done = count_iterations(run.path)
    if iterations is not None and done >= iterations:
        raise InputError(
            f"{folder} already has {done} iteration{'s' if done != 1 else ''}; give more with --iterations"
        )


def count_iterations(folder: Path) -> int:
    """Of a run, by its curves; 0 without any."""
    from vinl.rl.run_folder import METRICS

    file = folder / METRICS
    lines = file.read_text(encoding="utf-8").splitlines() if file.is_file() else []
    for line in reversed(lines):
        try:
            return int(json.loads(line)["iteration"])
        except (ValueError, KeyError, TypeError):  # a line that a kill cut off
            continue
    return 0
