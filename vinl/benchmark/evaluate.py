"""The evaluation as a whole: plans x seeds x episodes, in worker processes, kept episode by episode in memory or also
in a folder."""

from __future__ import annotations

import contextlib
import hashlib
import itertools
import os
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from vinl.benchmark.cluster import join_cluster
from vinl.benchmark.journal import Journal, read_wall_seconds
from vinl.benchmark.metrics import aggregate_episodes
from vinl.benchmark.protocol import (
    Films,
    Protocol,
    Row,
    Shared,
    cut_jobs,
    each_key,
    film_job,
    longest_first,
    missing_films,
    run_job,
)
from vinl.benchmark.recordings import forget_recordings, missing_recordings, without_poses, write_recording
from vinl.chain.choose import check_cameras, check_locomotion_policy, choose_locomotor, choose_navigator
from vinl.chain.config import EvaluationConfig, choose_rules
from vinl.chain.navigators.base import ORACLE, Navigator
from vinl.chain.navigators.learned import LearnedNavigator
from vinl.chain.navigators.oracle import OracleNavigator
from vinl.chain.navigators.recovery import RecoveringNavigator
from vinl.chain.records import Episode, Key, Results
from vinl.chain.workers import WorkerPool, show_line
from vinl.config.errors import InputError
from vinl.config.limits import check_number
from vinl.config.output import check_out, list_packages
from vinl.policies.identity import describe_policy
from vinl.policies.policy import Policy
from vinl.render.video import FilmJob, name_film
from vinl.world.clutter import choose_clutter
from vinl.world.floorplan import FloorPlan
from vinl.world.readers import open_floorplans


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
        self._policies = {"locomotion": describe_policy(row.locomotor), "navigation": describe_navigator(row.navigator)}
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


def evaluate(
    floorplans: str | Path | FloorPlan | Sequence[str | Path | FloorPlan] = (),
    locomotor: str | Path | Policy | None = None,
    navigator: str | Path | Navigator | None = None,
    episodes: int = 10,
    seeds: int = 5,
    *,
    obstacles: str = "paper",
    first_seed: int = 0,
    config: EvaluationConfig | None = None,
    workers: int = 1,
    films: Films = "none",
    out: str | Path | None = None,
    on_progress: Callable[[str, int, int], None] | None = None,
    cluster: str | None = None,
) -> Results:
    """Walk through floor plans and measure how it went.

    The result depends on plans, policies, config, episodes and seeds only, never on ``workers``. More than one worker
    means processes that are spawned: call it under ``if __name__ == "__main__":`` in a script.

    Args:
        floorplans: names, files or plans, or one of them; all shipped ones by default.
        locomotor: name or folder of a policy, or a loaded one; ``loco`` by default.
        navigator: name or folder of a navigation policy, ``"oracle"``, or a navigator of one's own, which is pickled
            with more than one worker; ``nav`` by default.
        episodes: start/goal pairs a plan; the same for all seeds.
        seeds: repetitions; a seed changes clutter, heading and joint angles at the start.
        obstacles: clutter preset.
        first_seed: the first of the repetitions.
        config: limits and rules; the paper's by default.
        workers: processes.
        films: which episodes are filmed: none, the first of every plan, or all of the first seed.
        out: folder for the films.
        on_progress: called with what is going on, pieces done and pieces in all, with ``"second"`` for every half
            second that robots walked, of at most so many; by default a bar shows it on a terminal and in a notebook.
        cluster: address of a Ray cluster that walks the episodes in place of this machine, or ``"local"``;
            ``workers`` are then its CPUs.

    Raises:
        InputError: a name is unknown, a number is out of range, a plan has no room for an episode, or the cluster
            cannot be reached.
    """
    config = choose_rules(config)
    opened = open_floorplans(floorplans)
    if not opened:
        raise InputError("no floor plan to walk through; give at least one")
    if films not in ("none", "first", "all"):
        raise InputError(f"films must be none, first or all, got {films!r}")
    if films != "none" and out is None:
        raise InputError("films need a folder to be written to; give out")
    check_numbers(episodes, seeds, first_seed, obstacles, workers)
    row = Row(choose_locomotor(locomotor), choose_navigator(navigator, config), obstacles)
    protocol = Protocol(name_apart(opened), episodes, range(first_seed, first_seed + seeds), config, films=films)
    folders = [None if out is None else check_out(out)]
    if on_progress is not None:
        return evaluate_rows([row], protocol, workers, folders, on_progress=on_progress, cluster=cluster)[0]
    with show_line("episodes", "episodes") as show:
        ended = 0, 1

        def note(what: str, done: int, total: int) -> None:
            nonlocal ended
            ended = (done, total) if what == "walk" else ended
            show(*ended)  # for every half second too: the clock of the bar goes on while no episode ends

        return evaluate_rows([row], protocol, workers, folders, on_progress=note, cluster=cluster)[0]


def evaluate_rows(
    rows: Sequence[Row],
    protocol: Protocol,
    workers: int | None = 1,
    folders: Sequence[Path | None] = (),
    keep: bool = False,
    fresh: bool = False,
    command: Sequence[str] = (),
    on_progress: Callable[[str, int, int], None] = lambda *_: None,
    cluster: str | None = None,
) -> list[Results]:
    """Walk the same episodes with several robots; all rows share the workers.

    Args:
        rows: who walks.
        protocol: where and by which rules.
        workers: processes; None: one for each CPU. Results do not depend on it.
        folders: one for each row, for its films and, with ``keep``, its episodes; needed for neither: may be left out.
        keep: append every episode that ended to a file in the row's folder, and walk only those that are not there.
        fresh: forget what the folders hold of earlier runs.
        command: kept in the folders beside the episodes.
        on_progress: see ``evaluate``.
        cluster: address of a Ray cluster that walks the episodes, see ``join_cluster``; None: this machine does.

    Raises:
        InputError: a policy is no locomotor, a plan has no room for an episode, a folder holds another evaluation, or
            the cluster cannot be reached.
    """
    for row in rows:
        check_locomotion_policy(row.locomotor)
        check_cameras(row.locomotor, row.navigator)
    began, where = time.perf_counter(), folders or [None] * len(rows)
    with contextlib.ExitStack() as stack:
        joined = None if cluster is None else stack.enter_context(join_cluster(cluster, workers))
        here = workers or os.cpu_count() or 1
        workers = here if joined is None else joined.workers
        routes = []
        for k, plan in enumerate(protocol.plans):
            on_progress("plan", k, len(protocol.plans))
            routes.append(protocol.find_routes(plan))
        wanted = list(each_key(protocol.plans, protocol.episodes, protocol.seeds))
        stores = [
            stack.enter_context(contextlib.closing(Store(row, protocol, folder, keep, fresh, command)))
            for row, folder in zip(rows, where, strict=True)
        ]
        jobs = []
        for k, (row, store) in enumerate(zip(rows, stores, strict=True)):
            missing, filmed = store.find_missing(wanted)
            if store.journal is not None and missing:
                store.journal.begin(workers)
            jobs += cut_jobs(k, row, protocol.plans, routes, wanted, missing, filmed, workers)
        jobs = longest_first(jobs, routes)
        total = len(wanted) * len(rows)
        lacking = sum(len(job.cells) for job in jobs)
        walked = itertools.count(total - lacking + 1)

        simulated = 0.0

        def add(row: int, piece: Episode | float) -> None:
            nonlocal simulated
            if isinstance(piece, Episode):
                stores[row].add(piece, time.perf_counter() - began)
                on_progress("walk", next(walked), total)
            else:
                simulated += piece
                on_progress("second", round(simulated), round(lacking * protocol.config.time_limit))

        on_progress("walk", total - lacking, total)
        shared = Shared(rows, protocol.plans, routes, protocol.config, protocol.record)
        pool = stack.enter_context(WorkerPool(min(here, max(len(jobs), 1)), shared))  # it starts at the first run
        units = pool.run(run_job, jobs, add) if joined is None else joined.run(shared, run_job, jobs, add)
        shots = [
            FilmJob(protocol.plans[job.plan], episode, str(where[job.row]))
            for job, unit in zip(jobs, units, strict=True)
            for episode in unit.values()
        ]
        if shots:  # films are files of this machine, whatever machine walked
            shown = itertools.count(1)
            on_progress("film", 0, len(shots))
            pool.run(film_job, shots, lambda: on_progress("film", next(shown), len(shots)))
        wall = time.perf_counter() - began
        return [store.results(wanted, wall, workers) for store in stores]


def name_apart(plans: Sequence[FloorPlan]) -> list[FloorPlan]:
    """Plans of the same name get a number: names are what seeds, records and films go by."""
    taken: dict[str, int] = {}
    apart = []
    for plan in plans:
        taken[plan.name] = taken.get(plan.name, 0) + 1
        k = taken[plan.name]
        apart.append(plan if k == 1 else replace(plan, name=f"{plan.name}-{k}"))
    return apart


def check_numbers(episodes: int, seeds: int, first_seed: int, obstacles: str, workers: int) -> None:
    """Refuse numbers and names that make no sense, before anything is loaded.

    Raises:
        InputError: one of them is out of range or unknown.
    """
    check_number("--episodes", episodes, 1, 10_000)
    check_number("--seeds", seeds, 1, 1_000)
    check_number("--workers", workers, 1, 1_024)
    check_number("--first-seed", first_seed, 0, 2**31 - 1)
    choose_clutter(obstacles)
