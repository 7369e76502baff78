"""The episodes of one row: in memory, or also in a folder."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from vinl.benchmark.journal import Journal, read_wall_seconds
from vinl.benchmark.metrics import aggregate_episodes
from vinl.benchmark.protocol import Protocol, Row, missing_films
from vinl.benchmark.recordings import forget_recordings, missing_recordings, without_poses, write_recording
from vinl.chain.navigators.base import ORACLE, Navigator
from vinl.chain.navigators.learned import LearnedNavigator
from vinl.chain.navigators.oracle import OracleNavigator
from vinl.chain.navigators.recovery import RecoveringNavigator
from vinl.chain.records import Episode, Key, Results
from vinl.config.output import list_packages
from vinl.policies.identity import describe_policy
from vinl.render.video import name_film
from vinl.world.floorplan import FloorPlan


class Store:
    """The episodes of one row as they end, in memory or also in a folder.

    Attributes:
        done: what there is.
        journal: the file, if they are kept.
    """

    def __init__(
        self, row: Row, protocol: Protocol, folder: Path | None, keep: bool, fresh: bool, command: Sequence[str]
    ) -> None:
        self._protocol, self._folder = protocol, folder
        self._config = protocol.describe(row)
        self._policies = {
            "locomotion": describe_policy(row.locomotor),
            "navigation": describe_navigator(row.navigator),
        }
        self.journal: Journal | None = None
        self.done: dict[Key, Episode] = {}
        if keep and folder is not None:
            about = {
                "command": list(command),
                "config": self._config,
                "policies": self._policies,
                "packages": list_packages(),
                "plans": [describe_plan(plan) for plan in protocol.plans],
            }
            self.journal = Journal(folder, about, protocol.plans, fresh)
            if fresh:
                forget_recordings(folder)
            self.done = self.journal.done

    def find_missing(self, wanted: Sequence[Key]) -> tuple[list[Key], set[Key]]:
        """The episodes that are to be walked, and those of them that are to be filmed.

        An episode that is there is walked again if its film or its recording is not.
        """
        known = self._folder if self.journal is not None and self.journal.resumed else None
        filmed = missing_films(wanted, self._protocol.films, self._protocol.seeds[0], folder=known)
        again = filmed | (missing_recordings(wanted, known) if self._protocol.record else set())
        return [key for key in wanted if key not in self.done or key in again], filmed

    def add(self, episode: Episode, wall: float) -> None:
        """An episode ended ``wall`` seconds after the beginning."""
        if self._protocol.record and self._folder is not None:
            write_recording(self._folder, episode)
            episode = without_poses(episode)
        if self.journal is not None:
            self.journal.add(episode, wall)
        else:
            self.done[episode.record.key] = episode

    def results(self, wanted: Sequence[Key], wall: float, workers: int) -> Results:
        """The whole row. ``wall``: how long it took, unless the folder knows of earlier sessions [s]."""
        protocol, done = self._protocol, [self.done[key] for key in wanted]
        aggregate = aggregate_episodes([e.record for e in done], protocol.config.min_metres)
        if self.journal is not None:
            assert self._folder is not None
            wall = read_wall_seconds(self._folder)
        videos = []
        if protocol.films != "none" and self._folder is not None:
            chosen = missing_films(wanted, protocol.films, protocol.seeds[0], folder=None)
            videos = [name_film(*key) for key in wanted if key in chosen]
        return Results(done, aggregate, list(protocol.plans), self._policies, self._config, wall, videos, workers)

    def close(self) -> None:
        """Let others write to the folder."""
        if self.journal is not None:
            self.journal.close()


def describe_navigator(navigator: Navigator) -> dict[str, Any]:
    """Which navigator it was: the policy, or the name alone."""
    if isinstance(navigator, RecoveringNavigator):
        return {**describe_navigator(navigator.inner), "recovery": True}
    if isinstance(navigator, LearnedNavigator):
        return describe_policy(navigator.policy)
    if isinstance(navigator, OracleNavigator):
        return {"name": ORACLE}
    return {"name": getattr(navigator, "name", type(navigator).__name__)}


def describe_plan(plan: FloorPlan) -> dict[str, Any]:
    """Which floor plan it was: walls, furniture and the inside, not where its file lay."""
    digest = hashlib.sha256()
    for rows in (plan.walls.rows, plan.furniture.rows):
        digest.update(np.ascontiguousarray(rows, np.float64).tobytes() + b"|")
    frame = plan.frame
    digest.update(repr((frame.x0, frame.y0, frame.resolution, frame.shape)).encode())
    digest.update(np.packbits(plan.inside).tobytes())
    return {"name": plan.name, "source": plan.source, "sha256": digest.hexdigest()}
