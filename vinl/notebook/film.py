"""A film that plays inside a notebook."""

from __future__ import annotations

import base64
import shutil
import tempfile
import weakref
from dataclasses import dataclass, replace
from pathlib import Path

from vinl.chain.records import Episode
from vinl.config.errors import InputError
from vinl.config.output import check_out
from vinl.notebook.walk import Walk
from vinl.render.video import POSE_DT, FilmJob, film


@dataclass(frozen=True)
class Film:
    """A film: show it as the last line of a cell, or open the file.

    Attributes:
        path: the MP4.
        width: in the notebook [pixels].
    """

    path: Path
    width: int = 800

    def __repr__(self) -> str:
        return f"Film({self.path.name})"

    def _repr_html_(self) -> str:
        """A player with the film inside: the notebook needs no file."""
        data = base64.b64encode(self.path.read_bytes()).decode()
        return f'<video controls width="{self.width}" src="data:video/mp4;base64,{data}"></video>'


def show_video(
    walk: Walk, start: float = 0.0, stop: float | None = None, out: str | Path | None = None, width: int = 800
) -> Film:
    """The film of a walk: the robot, what its cameras see, the map. About 0.1 s a picture, 12.5 pictures a second.

    Args:
        walk: the episode.
        start, stop: show this part [s]; all of it by default. The clock of the film begins with it.
        out: folder for the file; a temporary one by default, which is gone with the film.
        width: in the notebook [pixels].

    Raises:
        InputError: start and stop leave nothing to show, it is no walk, or the folder cannot be written to.
    """
    if not isinstance(walk, Walk):
        raise InputError(f"show_video shows what vinl.walk returns, got {type(walk).__name__}")
    if isinstance(start, (str, Path)):
        raise InputError(f"show_video(walk, start, stop): start is a time [s], got {start!r}; a folder is out=...")
    part = cut_episode(walk.episode, start, stop)
    folder = Path(tempfile.mkdtemp(prefix="vinl-film-")) if out is None else check_out(out)
    shown = Film(folder / film(FilmJob(walk.plan, part, str(folder)), walk.config), width)
    if out is None:
        weakref.finalize(shown, shutil.rmtree, folder, ignore_errors=True)
    return shown


def cut_episode(episode: Episode, start: float, stop: float | None) -> Episode:
    """The part of an episode from ``start`` to ``stop`` [s], as a film needs it.

    Raises:
        InputError: no pose lies between them.
    """
    trace, record = episode.trace, episode.record
    first, last = round(start / POSE_DT), len(trace.poses) if stop is None else round(stop / POSE_DT)
    if not 0 <= first < min(last, len(trace.poses)):
        raise InputError(f"nothing to show from {start:g} s to {stop or record.time_s:g} s of {record.time_s:g} s")
    end = record.time_s if stop is None else min(stop, record.time_s)
    kept = trace.contacts[(trace.contacts[:, 0] >= start) & (trace.contacts[:, 0] <= end)]
    part = replace(
        trace,
        poses=trace.poses[first:last],
        commands=trace.commands[first:last],
        contacts=kept - [first * POSE_DT, 0, 0, 0],
    )
    return Episode(record if end == record.time_s else replace(record, end_reason=""), part)
