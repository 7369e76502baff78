"""Which episodes are filmed, and which of these films are not there yet."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from vinl.evaluation.crew import Context
from vinl.evaluation.records import Key
from vinl.evaluation.video import FilmJob, film
from vinl.evaluation.video import name_film as name_film


def missing_films(wanted: Sequence[Key], films: str, seed: int, folder: Path | None) -> set[Key]:
    """The episodes to film: ``first`` of every plan, or ``all`` of the first seed, without those filmed before.

    Args:
        wanted: the episodes of the row.
        films: ``none``, ``first`` or ``all``.
        seed: the first one.
        folder: where films may already lie; None: none does.
    """
    if films == "none":
        return set()
    chosen = {key for key in wanted if key[1] == seed and (films == "all" or key[2] == 0)}
    return {key for key in chosen if folder is None or not (folder / name_film(*key)).exists()}


def film_job(context: Context, job: FilmJob) -> str:
    """One film, in whatever process."""
    name = film(job, context.shared.config, context.is_stopped)
    context.tell()
    return name
