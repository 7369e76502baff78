"""What an evaluation has done so far, kept in its folder: one line an episode, appended when the episode ends."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any, get_type_hints

import numpy as np

from vinl.chain.records import Episode, EpisodeRecord, EpisodeTrace
from vinl.config.errors import InputError
from vinl.config.output import write_json
from vinl.world.floorplan import FloorPlan
from vinl.world.readers import load_floorplan
from vinl.world.readers.own import write_floorplan

RUN_FILE, EPISODES_FILE, PLANS = "run.json", "episodes.jsonl", "plans"
SCHEMA = 1
"""Version of ``run.json`` and ``episodes.jsonl``."""

_WRITTEN = ("results.json", "report.html", RUN_FILE)
"""What a run leaves beside its episodes."""

_SHOWN = 3

_LARGEST = 1e12
"""No figure of an episode is larger."""

_PLACE = tuple[float, float]

_KINDS = get_type_hints(EpisodeRecord)


class Journal:
    """The file ``episodes.jsonl`` of a folder, which only ever grows, and ``run.json``, which says what it belongs to.

    A line is written whole and synced to the disk before the next episode is counted as done. What a killed process
    left of a line is cut off when the journal is opened again. One process at a time may have it open.

    Args:
        folder: made if it is not there.
        about: what the episodes depend on: plain data, compared key by key with what ``run.json`` says.
        plans: the floor plans, kept beside it so that the report can be drawn again from the folder alone.
        fresh: forget what the folder holds of an earlier run.

    Attributes:
        done: the episodes that are there, as the file has them.
        dropped: whether half a line was cut off.
        resumed: whether the folder held this evaluation before.

    Raises:
        InputError: the folder belongs to another run, another process writes to it, or a line is broken.
    """

    def __init__(self, folder: Path, about: Mapping[str, Any], plans: Sequence[FloorPlan], fresh: bool = False) -> None:
        self.folder, self.dropped, self.resumed = folder, False, False
        folder.mkdir(parents=True, exist_ok=True)
        self._file = (folder / EPISODES_FILE).open("a+b")
        try:
            _lock(self._file, folder)  # before anything is forgotten or written: another run may be at work here
            self._take_folder(about, plans, fresh)
            self._cut_half_line()
            self.done = {episode.record.key: episode for episode in read_episodes(folder)}
        except InputError:
            self._file.close()
            raise

    def _take_folder(self, about: Mapping[str, Any], plans: Sequence[FloorPlan], fresh: bool) -> None:
        folder = self.folder
        if fresh:
            self._file.truncate(0)
            for name in _WRITTEN:
                (folder / name).unlink(missing_ok=True)
        if (folder / RUN_FILE).exists():
            _refuse_other_run(folder, read_about(folder), about)
            self.resumed = True
        elif (folder / EPISODES_FILE).stat().st_size:
            raise InputError(f"{folder} holds {EPISODES_FILE} but no {RUN_FILE}; choose another --out, or give --fresh")
        else:
            keep_plans(folder, plans)
            write_json(folder / RUN_FILE, {"schema": SCHEMA, **about})

    def begin(self, workers: int) -> None:
        """Note that a session begins, for the time that the whole took."""
        self._append({"session": {"workers": workers}})

    def add(self, episode: Episode, wall: float) -> None:
        """Append an episode that ended ``wall`` seconds after the session began; one that is there is left alone."""
        if episode.record.key in self.done:
            return
        self._append({"wall": round(wall, 2), **plain_episode(episode)})
        self.done[episode.record.key] = episode

    def close(self) -> None:
        """Let others write."""
        self._file.close()

    def _append(self, data: Mapping[str, Any]) -> None:
        self._file.write(json.dumps(data, allow_nan=False).encode() + b"\n")
        self._file.flush()
        os.fsync(self._file.fileno())

    def _cut_half_line(self) -> None:
        self._file.seek(0)
        text = self._file.read()
        whole = text.rfind(b"\n") + 1
        if whole < len(text):
            self._file.truncate(whole)
            self.dropped = True


def plain_episode(episode: Episode) -> dict[str, Any]:
    """Record and trace as plain data, without poses: an episode that is to be filmed again is walked again."""
    trace = episode.trace
    parts = {"path": trace.path, "contacts": trace.contacts, "blocks": trace.blocks}
    return {"record": asdict(episode.record), "trace": {name: part.tolist() for name, part in parts.items()}}


def build_episode(data: Mapping[str, Any]) -> Episode:
    """What ``plain_episode`` was given."""
    trace = data["trace"]
    shapes = {"path": 2, "contacts": 4, "blocks": 6}
    parts = {name: np.array(trace[name], np.float64).reshape(-1, width) for name, width in shapes.items()}
    if not all((np.abs(part) < _LARGEST).all() for part in parts.values()):
        raise ValueError("a place is not finite")
    record = _build_record(data["record"])
    return Episode(record, EpisodeTrace(**parts, poses=np.zeros((0, 19)), commands=np.zeros((0, 3))))


def _build_record(data: Mapping[str, Any]) -> EpisodeRecord:
    """A record of values of its own kinds: a word in place of a number would be met where figures are drawn."""
    values = {**data, **{name: tuple(data[name]) for name in ("start", "goal")}}
    for name, kind in ((name, kind) for name, kind in _KINDS.items() if name in values):
        parts = values[name] if kind == _PLACE else (values[name],)
        if kind in (float, _PLACE):
            fits = all(type(part) in (float, int) and abs(part) < _LARGEST for part in parts)
        else:
            fits = type(values[name]) is kind
        if not fits or (kind == _PLACE and len(parts) != 2):
            raise ValueError(f"{name} is {values[name]!r}")
    return EpisodeRecord(**values)


def read_about(folder: Path) -> dict[str, Any]:
    """What ``run.json`` of a folder says.

    Raises:
        InputError: it is missing, broken or of another version.
    """
    path = folder / RUN_FILE
    try:
        about = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise InputError(f"{folder} is no folder of vinl eval: {RUN_FILE} is missing") from None
    except (OSError, ValueError) as error:
        raise InputError(f"{path} cannot be read ({error}); give --fresh, or another --out") from None
    if not isinstance(about, dict) or about.pop("schema", None) != SCHEMA:
        raise InputError(f"{path} was written by another version of vinl; give --fresh, or another --out")
    return about


def read_episodes(folder: Path) -> Iterator[Episode]:
    """The episodes of a folder in the order in which they ended; half a line at the end is left out.

    Raises:
        InputError: a line is broken.
    """
    for _, episode in _lines(folder):
        if episode is not None:
            yield episode


def read_wall_seconds(folder: Path) -> float:
    """How long all sessions took together, up to the last episode of each [s]."""
    sessions = [0.0]
    for data, episode in _lines(folder):
        if episode is None:
            sessions.append(0.0)
        else:
            sessions[-1] = max(sessions[-1], float(data["wall"]))
    return sum(sessions)


def keep_plans(folder: Path, plans: Sequence[FloorPlan]) -> None:
    """Write the floor plans, numbered in their order."""
    (folder / PLANS).mkdir(exist_ok=True)
    for k, plan in enumerate(plans):
        write_floorplan(plan, folder / PLANS / f"{k:03d}.json")


def read_plans(folder: Path, about: Mapping[str, Any]) -> list[FloorPlan]:
    """The floor plans of a folder, with the names and sources that they had."""
    plans = []
    for k, known in enumerate(about["plans"]):
        plan = load_floorplan(folder / PLANS / f"{k:03d}.json")
        plans.append(replace(plan, name=known["name"], source=known["source"]))
    return plans


def list_differences(one: Any, other: Any, at: str = "") -> Iterator[tuple[str, Any, Any]]:
    """Where two pieces of plain data differ: dotted key, the one's value, the other's; None where there is none."""
    if isinstance(one, Mapping) and isinstance(other, Mapping):
        for key in [*one, *(k for k in other if k not in one)]:
            yield from list_differences(one.get(key), other.get(key), f"{at}.{key}" if at else str(key))
    elif isinstance(one, list) and isinstance(other, list) and len(one) == len(other):
        for k, (a, b) in enumerate(zip(one, other, strict=True)):
            yield from list_differences(a, b, f"{at}[{k}]")
    elif one != other:
        yield at, one, other


def describe_differences(one: Any, other: Any, names: tuple[str, str]) -> str:
    """The first differences in words; empty if there is none."""
    found = [
        f"{at} is {_short(a)} {names[0]} and {_short(b)} {names[1]}"
        for at, a, b in list_differences(json.loads(json.dumps(one)), json.loads(json.dumps(other)))
    ]
    more = f", and {len(found) - _SHOWN} more" if len(found) > _SHOWN else ""
    return "; ".join(found[:_SHOWN]) + more


def _lines(folder: Path) -> Iterator[tuple[dict[str, Any], Episode | None]]:
    """Every whole line, with its episode unless it is the beginning of a session."""
    path = folder / EPISODES_FILE
    text = path.read_bytes() if path.exists() else b""
    for number, line in enumerate(text[: text.rfind(b"\n") + 1].splitlines(), 1):
        try:
            data = json.loads(line)
            episode = None if "session" in data else build_episode(data)
        except (ValueError, KeyError, TypeError) as error:
            raise InputError(f"{path}, line {number} is broken ({error}); remove the line, or give --fresh") from None
        yield data, episode


def _refuse_other_run(folder: Path, there: Mapping[str, Any], now: Mapping[str, Any]) -> None:
    differences = describe_differences(_compared(there), _compared(now), ("there", "now"))
    if differences:
        raise InputError(
            f"{folder} holds another evaluation: {differences}; choose another --out, or give --fresh to begin anew"
        )


def _compared(about: Mapping[str, Any]) -> dict[str, Any]:
    """All but the words of the command, which may differ where no figure does, and where the plans' files lie."""
    kept = {key: value for key, value in about.items() if key != "command"}
    return kept | {"plans": [{k: v for k, v in plan.items() if k != "source"} for plan in about.get("plans", [])]}


def _short(value: Any) -> str:
    text = json.dumps(value)
    return text if len(text) <= 60 else f"{text[:57]}..."


def _lock(file: Any, folder: Path) -> None:
    try:
        import fcntl
    except ImportError:  # no such locks on Windows
        return
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        raise InputError(
            f"{folder}: another vinl eval is writing there; wait for it, or choose another --out"
        ) from None
