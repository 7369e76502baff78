"""The evaluation as a whole: plans x seeds x episodes, in worker processes, kept episode by episode."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any, Literal

from vinl.config.errors import InputError
from vinl.config.fields import closest
from vinl.config.loader import dump_config
from vinl.evaluation.config import EvaluationConfig
from vinl.evaluation.crew import Crew
from vinl.evaluation.describe import describe_navigator, describe_plan, list_packages
from vinl.evaluation.describe import describe_policy as describe_policy
from vinl.evaluation.episodes import draw_routes
from vinl.evaluation.filming import film_job, missing_films
from vinl.evaluation.journal import Journal, read_wall_seconds
from vinl.evaluation.metrics import aggregate_episodes
from vinl.evaluation.navigator import ORACLE, Navigator, load_navigator
from vinl.evaluation.records import Episode, Key, Results
from vinl.evaluation.routes import describe_routes
from vinl.evaluation.senses import check_cameras
from vinl.evaluation.senses import check_senses as check_senses
from vinl.evaluation.shard import Shard
from vinl.evaluation.video import FilmJob
from vinl.evaluation.work import Row, Shared, cut_jobs, list_keys, run_job
from vinl.policies.io import load_policy
from vinl.policies.policy import Policy
from vinl.world.clutter import CLUTTER
from vinl.world.floorplan import FloorPlan
from vinl.world.start_goal import StartGoal

Films = Literal["none", "first", "all"]
MAX_EPISODES, MAX_SEEDS, MAX_WORKERS = 10_000, 1_000, 1_024


@dataclass(frozen=True, eq=False)
class Protocol:
    """What all rows of a table have in common.

    Attributes:
        plans: where they walk; names differ, see ``name_apart``.
        episodes: start/goal pairs a plan; the same for all seeds.
        seeds: repetitions; a seed changes clutter, heading and joint angles at the start.
        config: limits and rules.
        shard: which share of the episodes is walked.
        films: which episodes are filmed: none, the first of every plan, or all of the first seed.
        routes: start/goal pairs of one's own for every plan, ``episodes`` each, see ``routes``; None: they are drawn.
    """

    plans: Sequence[FloorPlan]
    episodes: int = 10
    seeds: range = range(5)
    config: EvaluationConfig = field(default_factory=EvaluationConfig)
    shard: Shard = field(default_factory=Shard)
    films: Films = "none"
    routes: Mapping[str, Sequence[StartGoal]] | None = None

    def describe(self, row: Row) -> dict[str, Any]:
        """What the episodes of a row depend on, as plain data."""
        return {
            "evaluation": dump_config(self.config),
            "obstacles": {"preset": row.obstacles, **asdict(CLUTTER[row.obstacles])},
            "episodes_per_plan": self.episodes,
            "seeds": list(self.seeds),
            **({} if self.routes is None else {"routes": describe_routes(self.routes)}),
        }

    def find_routes(self, plan: FloorPlan) -> list[StartGoal]:
        """The start/goal pairs of a plan."""
        if self.routes is None:
            return draw_routes(plan, self.episodes, self.config)
        return list(self.routes[plan.name])


def evaluate(
    floorplans: Sequence[FloorPlan],
    locomotor: str | Path | Policy = "rough",
    navigator: str | Path | Navigator = ORACLE,
    episodes: int = 10,
    seeds: int = 5,
    first_seed: int = 0,
    obstacles: str = "none",
    config: EvaluationConfig | None = None,
    workers: int = 1,
    films: Films = "none",
    out: Path | None = None,
    on_progress: Callable[[str, int, int], None] = lambda *_: None,
) -> Results:
    """Walk through floor plans and measure how it went.

    The result depends on plans, policies, config, episodes and seeds only, never on ``workers``. More than one worker
    means processes that are spawned: call it under ``if __name__ == "__main__":`` in a script.

    Args:
        floorplans: see ``vinl.world.readers``.
        locomotor: name or folder of a policy, or a loaded one.
        navigator: ``"oracle"``, name or folder of a navigation policy, or a navigator of one's own; with more than one
            worker it is pickled.
        episodes: start/goal pairs a plan; the same for all seeds.
        seeds: repetitions; a seed changes clutter, heading and joint angles at the start.
        first_seed: the first of them.
        obstacles: clutter preset.
        config: limits and rules; the paper's by default.
        workers: processes.
        films: which episodes are filmed: none, the first of every plan, or all of the first seed.
        out: folder for the films.
        on_progress: called with what is going on, pieces done and pieces in all.

    Raises:
        InputError: a name is unknown, a number is out of range, or a plan has no room for an episode.
    """
    config = config or EvaluationConfig()
    if not floorplans:
        raise InputError("no floor plan to walk through; give at least one")
    if films not in ("none", "first", "all"):
        raise InputError(f"films must be none, first or all, got {films!r}")
    if films != "none" and out is None:
        raise InputError("films need a folder to be written to; give out")
    check_numbers(episodes, seeds, first_seed, obstacles, workers)
    guide = load_navigator(navigator, config) if isinstance(navigator, (str, Path)) else navigator
    policy = load_policy(locomotor) if isinstance(locomotor, (str, Path)) else locomotor
    plans, span = name_apart(floorplans), range(first_seed, first_seed + seeds)
    protocol = Protocol(plans, episodes, span, config, films=films)
    return evaluate_rows([Row(policy, guide, obstacles)], protocol, workers, [out], on_progress=on_progress)[0]


def evaluate_rows(
    rows: Sequence[Row],
    protocol: Protocol,
    workers: int = 1,
    folders: Sequence[Path | None] = (),
    keep: bool = False,
    fresh: bool = False,
    command: Sequence[str] = (),
    on_progress: Callable[[str, int, int], None] = lambda *_: None,
) -> list[Results]:
    """Walk the same episodes with several robots; all rows share the workers.

    Args:
        rows: who walks.
        protocol: where and by which rules.
        workers: processes; results do not depend on it.
        folders: one for each row, for its films and, with ``keep``, its episodes; needed for neither: may be left out.
        keep: append every episode that ended to a file in the row's folder, and walk only those that are not there.
        fresh: forget what the folders hold of earlier runs.
        command: kept in the folders beside the episodes.
        on_progress: called with what is going on, pieces done and pieces in all.

    Raises:
        InputError: a policy is no locomotor, a plan has no room for an episode, or a folder holds another evaluation.
    """
    for row in rows:
        check_senses(row.locomotor)
        check_cameras(row.locomotor, row.navigator)
    began, workers = time.perf_counter(), max(workers, 1)
    where: Sequence[Path | None] = folders or [None] * len(rows)
    routes = []
    for k, plan in enumerate(protocol.plans):
        on_progress("plan", k, len(protocol.plans))
        routes.append(protocol.find_routes(plan))
    wanted = list_keys(protocol.plans, protocol.episodes, protocol.seeds, protocol.shard)
    if not wanted:
        raise InputError(f"--shard {protocol.shard}: there are not so many episodes; take fewer shards")
    stores: list[Store] = []
    try:
        for row, folder in zip(rows, where, strict=True):
            stores.append(Store(row, protocol, folder, keep, fresh, command))
        jobs = []
        for k, (row, store) in enumerate(zip(rows, stores, strict=True)):
            filmed = missing_films(wanted, protocol.films, protocol.seeds[0], folder=where[k])
            missing = [key for key in wanted if key not in store.done or key in filmed]
            if store.journal is not None and missing:
                store.journal.begin(workers)
            jobs += cut_jobs(k, row, protocol.plans, wanted, missing, filmed, workers)
        todo = sum(len(job.cells) for job in jobs)
        total, done = len(wanted) * len(rows), len(wanted) * len(rows) - todo

        def add(row: int, episode: Episode) -> None:
            nonlocal done
            stores[row].add(episode, time.perf_counter() - began)
            done += 1
            on_progress("walk", done, total)

        on_progress("walk", done, total)
        shared = Shared(rows, protocol.plans, routes, protocol.config)
        with Crew(min(workers, max(len(jobs), 1)), shared) as crew:
            units = crew.run(run_job, jobs, add)
            shots = [
                FilmJob(protocol.plans[job.plan], episode, str(where[job.row]))
                for job, unit in zip(jobs, units, strict=True)
                for episode in unit.values()
            ]
            if shots:
                shown = 0

                def count() -> None:
                    nonlocal shown
                    shown += 1
                    on_progress("film", shown, len(shots))

                on_progress("film", 0, len(shots))
                crew.run(film_job, shots, count)
        wall = time.perf_counter() - began
        return [store.results(wanted, wall) for store in stores]
    finally:
        for store in stores:
            store.close()


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
                "shard": str(protocol.shard),
            }
            self.journal = Journal(folder, about, protocol.plans, fresh)
            self.done = self.journal.done

    def add(self, episode: Episode, wall: float) -> None:
        """An episode ended ``wall`` seconds after the beginning."""
        if self.journal is not None:
            self.journal.add(episode, wall)
        else:
            self.done[episode.record.key] = episode

    def results(self, wanted: Sequence[Key], wall: float) -> Results:
        """The whole row. ``wall``: how long it took, unless the folder knows of earlier sessions [s]."""
        protocol, done = self._protocol, [self.done[key] for key in wanted]
        aggregate = aggregate_episodes([e.record for e in done], protocol.config.min_metres)
        if self.journal is not None:
            assert self._folder is not None
            wall = read_wall_seconds(self._folder)
        videos = []
        if protocol.films != "none" and self._folder is not None:
            chosen = missing_films(wanted, protocol.films, protocol.seeds[0], folder=None)
            videos = [FilmJob(_plan_of(protocol, key), self.done[key], "").name for key in wanted if key in chosen]
        return Results(done, aggregate, list(protocol.plans), self._policies, self._config, wall, videos)

    def close(self) -> None:
        """Let others write to the folder."""
        if self.journal is not None:
            self.journal.close()


def _plan_of(protocol: Protocol, key: Key) -> FloorPlan:
    return next(plan for plan in protocol.plans if plan.name == key[0])


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
    for name, value, limit in (
        ("episodes", episodes, MAX_EPISODES),
        ("seeds", seeds, MAX_SEEDS),
        ("workers", workers, MAX_WORKERS),
    ):
        if not 1 <= value <= limit:
            raise InputError(f"--{name} must lie between 1 and {limit}, got {value}")
    if not 0 <= first_seed < 2**31:
        raise InputError(f"--first-seed must lie between 0 and {2**31 - 1}, got {first_seed}")
    if obstacles not in CLUTTER:
        raise InputError(
            f"--obstacles {obstacles!r} is not a preset{closest(obstacles, CLUTTER)}; known: {', '.join(CLUTTER)}"
        )
