"""A training run on disk: configuration, curves, checkpoints. Everything in it survives a kill at any moment."""

from __future__ import annotations

import contextlib
import io
import json
import pickle
from pathlib import Path
from typing import Any

import numpy as np
import torch
import yaml

from vinl.config.errors import InputError
from vinl.config.output import write_text, write_whole
from vinl.policies.card import read_card

CONFIG = "config.yaml"
METRICS = "metrics.jsonl"
CHECKPOINT = "checkpoint.pt"
ORIGIN = "origin.json"
LOST = "not_finite"
"""Folder of the states of robots whose numbers went wrong."""

MAX_LOST = 20
"""How many of them a run keeps: the first ones."""


class RunFolder:
    """The files of one run.

    Raises:
        InputError: from ``create`` and ``open``, see there.
    """

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)

    @property
    def policy(self) -> Path:
        """Where the policy is exported to."""
        return self.path / "policy"

    def create(self, config: dict[str, Any]) -> None:
        """A new run.

        Raises:
            InputError: the folder holds a run already, or is a file.
        """
        if self.path.exists() and not self.path.is_dir():
            raise InputError(f"{self.path} is a file; choose a folder for the run with --out")
        if (self.path / CONFIG).exists():
            raise InputError(f"{self.path} holds a run already; continue it with --resume, or choose another --out")
        write_text(self.path / CONFIG, yaml.safe_dump(config, sort_keys=False))

    def open(self) -> dict[str, Any]:
        """The configuration of a run that exists.

        Raises:
            InputError: there is no run in the folder, or its configuration is broken.
        """
        file = self.path / CONFIG
        if not file.is_file():
            raise InputError(f"{self.path} holds no training run ({CONFIG} is missing)")
        try:
            config = yaml.safe_load(file.read_text(encoding="utf-8"))
        except (yaml.YAMLError, UnicodeDecodeError) as error:
            raise InputError(f"{file} is broken: {' '.join(str(error).split())}") from None
        if not isinstance(config, dict):
            raise InputError(f"{file} is broken: it holds no settings")
        return config

    def write_origin(self, origin: dict[str, Any]) -> None:
        """Note where the networks of the run come from."""
        write_text(self.path / ORIGIN, json.dumps(origin, indent=2) + "\n")

    def read_origin(self) -> dict[str, Any] | None:
        """Where the networks of the run come from; None: they were fresh.

        Raises:
            InputError: the note is broken.
        """
        file = self.path / ORIGIN
        if not file.exists():
            return None
        try:
            return json.loads(file.read_text(encoding="utf-8"))
        except ValueError:
            raise InputError(f"{file} is broken; remove it") from None

    def save_checkpoint(self, checkpoint: dict[str, Any]) -> None:
        """Replace the checkpoint, whole or not at all.

        Raises:
            OSError: there is no room for it; it names the file.
        """
        packed = io.BytesIO()  # torch.save itself does not say what is wrong with the disk
        torch.save(checkpoint, packed)
        with write_whole(self.path / CHECKPOINT) as file:
            file.write(packed.getbuffer())

    def load_checkpoint(self) -> dict[str, Any] | None:
        """The newest checkpoint on the CPU, or None when the run was stopped before its first.

        Raises:
            InputError: the checkpoint is broken.
        """
        file = self.path / CHECKPOINT
        if not file.exists():
            return None
        try:
            return torch.load(file, map_location="cpu", weights_only=True)
        except (RuntimeError, OSError, EOFError, pickle.UnpicklingError, ValueError) as error:
            first = str(error).splitlines()[0] if str(error) else type(error).__name__
            raise InputError(f"{file} is broken ({first}); remove it to start the run anew") from None

    def read_last_metrics(self) -> dict[str, float] | None:
        """The newest whole line of the curves; None: there is none."""
        curves = self.path / METRICS
        for line in reversed(curves.read_text(encoding="utf-8").splitlines() if curves.is_file() else []):
            with contextlib.suppress(ValueError, KeyError, TypeError):  # a line that a kill cut off
                row = json.loads(line)
                return row | {"iteration": int(row["iteration"])}
        return None

    def is_complete(self) -> bool:
        """Whether the policy is that of the last iteration of the configuration.

        Raises:
            InputError: the configuration is broken.
        """
        row, wanted = self.read_last_metrics(), self.open().get("iterations")
        if row is None or not isinstance(wanted, int) or row["iteration"] < wanted:
            return False
        try:  # checkpoint and policy are written after the curves, and a kill may come between
            return read_card(self.policy).samples == row.get("samples")
        except InputError:  # it is written anew
            return False

    def save_lost(self, state: dict[str, Any]) -> Path | None:
        """Save the state of a robot whose numbers went wrong, with the run's configuration, for ``vinl replay-nan``.

        Args:
            state: numbers, arrays and text by name.

        Returns:
            The file ``not_finite/NUMBER.npz``; None: the run keeps ``MAX_LOST`` of them already.
        """
        folder = self.path / LOST
        number = len(list(folder.glob("*.npz"))) + 1
        if number > MAX_LOST:
            return None
        file, config = folder / f"{number:06d}.npz", self.path / CONFIG
        with write_whole(file) as stream:
            np.savez(stream, config=config.read_text(encoding="utf-8") if config.is_file() else "", **state)
        return file

    def append_metrics(self, row: dict[str, float]) -> None:
        """Add a line to the curves."""
        try:
            with (self.path / METRICS).open("a", encoding="utf-8") as file:
                file.write(json.dumps(row) + "\n")
        except OSError as error:
            raise OSError(error.errno, error.strerror, str(self.path / METRICS)) from None

    def cut_metrics(self, iteration: int) -> None:
        """Drop the lines beyond a checkpoint's iteration, and one that was cut off by a kill."""
        file = self.path / METRICS
        if not file.exists():
            return
        kept = []
        for line in file.read_text(encoding="utf-8").splitlines():
            try:
                row = json.loads(line)
            except json.JSONDecodeError:
                break
            if row["iteration"] > iteration:
                break
            kept.append(line + "\n")
        write_text(file, "".join(kept))
