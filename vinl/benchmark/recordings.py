"""The poses of recorded episodes, one small file each in the folder of their run.

25 a second in about 1 kB: positions to the micrometre, angles to a milliradian."""

from __future__ import annotations

import zipfile
from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from vinl.benchmark.journal import RUN_FILE, read_about, read_episodes, read_plans
from vinl.chain.records import Episode, EpisodeTrace, Key, name_episode
from vinl.config.errors import InputError
from vinl.config.output import write_whole
from vinl.world.floorplan import FloorPlan

RECORDINGS = "recordings"
"""Folder of the recordings, in the folder of a run."""

_COLUMNS = {"position": slice(0, 3), "orientation": slice(3, 7), "joints": slice(7, 19)}
_WIDTHS = {"position": 3, "orientation": 4, "joints": 12, "command": 3}


def find_recording(folder: Path, key: Key) -> Path:
    """The file of an episode, whether it is there or not."""
    return folder / RECORDINGS / f"{name_episode(*key)}.npz"


def write_recording(folder: Path, episode: Episode) -> Path:
    """Keep the poses of an episode, whole or not at all."""
    path, trace = find_recording(folder, episode.record.key), episode.trace
    parts = {name: trace.poses[:, columns] for name, columns in _COLUMNS.items()} | {"command": trace.commands}
    kinds = {name: np.float32 if name == "position" else np.float16 for name in parts}
    arrays: dict[str, Any] = {name: part.astype(kinds[name]) for name, part in parts.items()}
    with write_whole(path) as file:
        np.savez_compressed(file, **arrays)
    return path


def read_recording(folder: Path, episode: Episode) -> EpisodeTrace:
    """The trace of an episode with its poses.

    Raises:
        InputError: the file is missing or broken.
    """
    path = find_recording(folder, episode.record.key)
    try:
        with path.open("rb") as raw, np.load(raw, allow_pickle=False) as file:
            parts = {name: np.asarray(file[name], np.float64).reshape(-1, width) for name, width in _WIDTHS.items()}
    except FileNotFoundError:
        raise InputError(f"{path} is missing; walk the episode again with vinl eval --record") from None
    except (OSError, ValueError, KeyError, TypeError, EOFError, zipfile.BadZipFile):
        raise InputError(f"{path} is broken; delete it, and walk the episode again with vinl eval --record") from None
    rows = {len(part) for part in parts.values()}
    if len(rows) != 1 or not min(rows) or not all(np.isfinite(part).all() for part in parts.values()):
        raise InputError(f"{path} is broken; delete it, and walk the episode again with vinl eval --record")
    turn = parts["orientation"] / np.linalg.norm(parts["orientation"], axis=1, keepdims=True)
    poses = np.concatenate([parts["position"], turn, parts["joints"]], 1)
    return replace(episode.trace, poses=poses, commands=parts["command"])


def without_poses(episode: Episode) -> Episode:
    """The episode without what its recording holds."""
    return replace(episode, trace=replace(episode.trace, poses=np.zeros((0, 19)), commands=np.zeros((0, 3))))


def missing_recordings(wanted: Iterable[Key], folder: Path | None) -> set[Key]:
    """The episodes that a folder has no recording of; None: a folder without any."""
    return {key for key in wanted if folder is None or not find_recording(folder, key).is_file()}


def forget_recordings(folder: Path) -> None:
    """Delete the recordings of a run that begins anew: they would no longer belong to its episodes."""
    for path in (folder / RECORDINGS).glob("*.npz"):
        path.unlink()


class Recordings:
    """The recorded episodes of a folder, in the order of ``results.json``.

    Attributes:
        labels: one for each episode: number, plan, pair, seed and how it ended.

    Raises:
        InputError: the folder is none of ``vinl eval``, or holds no recordings.
    """

    def __init__(self, folder: Path) -> None:
        if not folder.is_dir():
            raise InputError(f"{folder} is no folder; give one that vinl eval --record wrote")
        if not (folder / RUN_FILE).is_file() and any(folder.glob(f"*/{RUN_FILE}")):
            rows = ", ".join(sorted(path.parent.name for path in folder.glob(f"*/{RUN_FILE}")))
            raise InputError(f"{folder} holds a table; give the folder of one of its rows: {rows}")
        self._folder, about = folder, read_about(folder)
        plans = {plan.name: plan for plan in read_plans(folder, about)}
        order = list(plans)
        kept = [e for e in read_episodes(folder) if find_recording(folder, e.record.key).is_file()]
        if not kept:
            raise InputError(f"{folder} holds no recordings; walk it again with vinl eval --record")
        kept.sort(key=lambda e: (order.index(e.record.plan), e.record.seed, e.record.episode))
        self._plans, self._episodes = plans, kept
        self.labels: Sequence[str] = [
            f"{k}: {r.plan}, pair {r.episode}, seed {r.seed}, {r.end_reason}"
            for k, r in enumerate(e.record for e in kept)
        ]

    def open(self, number: int) -> tuple[FloorPlan, Episode]:
        """An episode with its poses, and its floor plan."""
        episode = self._episodes[number]
        return self._plans[episode.record.plan], Episode(episode.record, read_recording(self._folder, episode))
