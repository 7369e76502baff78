"""A training in one line, and what became of it."""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import count
from pathlib import Path
from typing import Any

from vinl.config.errors import InputError
from vinl.config.loader import load_config
from vinl.config.output import check_out
from vinl.policies.device import choose_training_device
from vinl.policies.io import load_policy
from vinl.policies.policy import Policy
from vinl.rl.machine import explain_out_of_memory, use_compile_cache


@dataclass(frozen=True)
class Training:
    """A training run.

    Attributes:
        folder: with checkpoint, curves and policy; any command takes it as a policy.
        complete: False if it was interrupted; ``vinl train-loco --resume`` or ``train-nav --resume`` go on.
    """

    folder: Path
    complete: bool

    def __repr__(self) -> str:
        return f"Training({self.folder}: {'complete' if self.complete else 'interrupted'})"

    @property
    def policy(self) -> Policy:
        """What it has learned."""
        return load_policy(self.folder)

    @property
    def metrics(self) -> list[dict[str, Any]]:
        """The curves: a row for each iteration."""
        text = (self.folder / "metrics.jsonl").read_text(encoding="utf-8")
        return [json.loads(line) for line in text.splitlines()]


def train(
    config: str,
    overrides: Sequence[str] = (),
    out: str | Path | None = None,
    device: str = "auto",
    from_policy: str | None = None,
) -> Training:
    """Train a locomotor or a navigator, as ``vinl train-loco`` and ``vinl train-nav`` do. Needs the ``train`` extra.

    Args:
        config: ``"loco/rough"``, ``"loco/teacher"``, ``"loco/student"``, ``"nav/default"`` and others in ``configs/``.
        overrides: settings as ``key=value``.
        out: folder of the new run; by default one below ``runs/`` that is not there yet.
        device: ``"cpu"``, ``"cuda"``, or ``"auto"``: a GPU where there is one.
        from_policy: start from the networks of this policy or run; by default what the config says.

    Raises:
        InputError: a name, a setting or the folder cannot be used.
    """
    device = choose_training_device(device)
    kind, folder = config.split("/")[0], check_out(_find_place(config) if out is None else out)
    if kind == "nav":
        from vinl.nav.config import NavConfig
        from vinl.nav.training import train_navigator

        settings = load_config(NavConfig, config, overrides)
        with explain_out_of_memory(settings.num_envs):
            return Training(folder, train_navigator(settings, folder, device, from_policy=from_policy))
    if kind == "loco":
        os.environ.setdefault("JAX_PLATFORMS", "cpu" if device == "cpu" else "cuda,cpu")
        use_compile_cache()
        from vinl.loco.config import LocoConfig
        from vinl.loco.training import train_locomotor

        more = [] if from_policy is None else [f"from_policy={from_policy}"]
        settings = load_config(LocoConfig, config, [*overrides, *more])
        with explain_out_of_memory(settings.num_envs):
            return Training(folder, train_locomotor(settings, folder, device))
    raise InputError(f"config {config!r} says neither loco/... nor nav/...; vinl train-loco and train-nav take files")


def _find_place(config: str) -> Path:
    """``runs/rough`` for ``loco/rough``, or the first of ``runs/rough-2`` and so on that is not there yet."""
    name = config.removesuffix(".yaml").replace("loco/", "").replace("/", "-")
    numbers = (Path("runs") / (name if k == 1 else f"{name}-{k}") for k in count(1))
    return next(folder for folder in numbers if not folder.exists())
