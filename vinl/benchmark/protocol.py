"""What is to be done: who walks where, from which starts to which goals, by which rules, and how the episodes are cut
into pieces of work."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any, Literal, TypeVar

from vinl.benchmark.routes import describe_routes
from vinl.chain.batching import CANDIDATES, is_steady, is_steady_navigator
from vinl.chain.config import EvaluationConfig
from vinl.chain.episode import draw_routes, draw_setup
from vinl.chain.navigators.base import Navigator
from vinl.chain.records import Episode, Key
from vinl.chain.rollout import run_episodes
from vinl.chain.workers import Context
from vinl.config.loader import build_config, dump_config
from vinl.policies.policy import Policy
from vinl.render.video import FilmJob, film, name_film
from vinl.robot.aliengo import CONTROL_DT
from vinl.world.clutter import CLUTTER
from vinl.world.floorplan import FloorPlan
from vinl.world.start_goal import StartGoal

T = TypeVar("T")
Films = Literal["none", "first", "all"]

LARGEST = 24
"""Episodes in a piece of work at most: as many as one call of a network holds. More would wait for each other."""

_PIECES = 3
"""So many pieces of work for each of several workers, so that none is idle for long at the end."""


@dataclass(frozen=True, eq=False)
class Row:
    """One line of a table: who walks, through what clutter, under which rules (settings in place of the protocol's)."""

    locomotor: Policy
    navigator: Navigator
    obstacles: str = "none"
    settings: tuple[str, ...] = ()

    def apply(self, config: EvaluationConfig) -> EvaluationConfig:
        """The rules with the row's own settings."""
        return build_config(EvaluationConfig, dump_config(config), self.settings) if self.settings else config


@dataclass(frozen=True, eq=False)
class Protocol:
    """What all rows of a table have in common.

    Attributes:
        plans: where they walk; names differ, see ``name_apart``.
        episodes: start/goal pairs a plan; the same for all seeds.
        seeds: repetitions; a seed changes clutter, heading and joint angles at the start.
        films: which episodes are filmed: none, the first of every plan, or all of the first seed.
        record: keep the poses of all episodes in files, see ``recordings``.
        routes: start/goal pairs of one's own for every plan, ``episodes`` each, see ``routes``; None: they are drawn.
    """

    plans: Sequence[FloorPlan]
    episodes: int = 10
    seeds: range = range(5)
    config: EvaluationConfig = field(default_factory=EvaluationConfig)
    films: Films = "none"
    routes: Mapping[str, Sequence[StartGoal]] | None = None
    record: bool = False

    def describe(self, row: Row) -> dict[str, Any]:
        """What the episodes of a row depend on, as plain data."""
        return {
            "evaluation": dump_config(row.apply(self.config)),
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


@dataclass(frozen=True, eq=False)
class Shared:
    """What all pieces of work have in common: every worker gets it once."""

    rows: Sequence[Row]
    plans: Sequence[FloorPlan]
    routes: Sequence[list[StartGoal]]
    config: EvaluationConfig
    record: bool = False
    """Keep the poses of all episodes."""


@dataclass(frozen=True)
class Job:
    """A piece of work: episodes of one row in one plan, which walk side by side.

    Attributes:
        row, plan: numbers in ``Shared``.
        cells: seed and number of each episode.
        filmed: those whose poses are kept.
        at_once: report them when all have ended, not one by one.
    """

    row: int
    plan: int
    cells: tuple[tuple[int, int], ...]
    filmed: tuple[tuple[int, int], ...] = ()
    at_once: bool = False


def each_key(plans: Sequence[FloorPlan], episodes: int, seeds: range) -> Iterator[Key]:
    """All episodes of a row in the order of the results."""
    return ((plan.name, seed, k) for plan in plans for seed in seeds for k in range(episodes))


def cut_jobs(
    row: int,
    who: Row,
    plans: Sequence[FloorPlan],
    routes: Sequence[Sequence[StartGoal]],
    wanted: Sequence[Key],
    missing: Collection[Key],
    filmed: Collection[Key],
    workers: int,
) -> list[Job]:
    """The pieces of work of a row.

    Where an episode does not depend on those that it is run with, pieces are as large as the number of workers allows,
    and hold episodes whose ways are about as long: one robot alone costs more than its share in a full call.
    With a policy of one's own they are all episodes of a plan and a seed, whatever is missing of them.
    """
    steady = is_steady(who.locomotor) and is_steady_navigator(who.navigator)
    share = -(-len(missing) // workers)
    pieces = _PIECES if workers > 1 else 1  # one alone waits for nobody
    together = min(share, CANDIDATES[0])  # no call is smaller
    size = max(1, min(LARGEST, max(-(-share // pieces), together)))
    jobs = []
    for number, plan in enumerate(plans):
        lacking = {(seed, k) for name, seed, k in missing if name == plan.name}
        if steady:
            cells = sorted(lacking, key=lambda cell: (-routes[number][cell[1]].geodesic_m, cell))
            parts = split_evenly(cells, size)
        else:
            cells = [(seed, k) for name, seed, k in wanted if name == plan.name]
            parts = [[cell for cell in cells if cell[0] == seed] for seed in sorted({seed for seed, _ in lacking})]
        for part in parts:
            shown = tuple(cell for cell in part if (plan.name, *cell) in filmed)
            jobs.append(Job(row, number, tuple(part), shown, not steady))
    return jobs


def split_evenly(cells: Sequence[T], largest: int) -> list[Sequence[T]]:
    """As few pieces as possible of at most so many cells, none larger than another by more than one."""
    count = -(-len(cells) // largest)
    bounds = [len(cells) * k // count for k in range(count + 1)] if count else []
    return [cells[a:b] for a, b in pairwise(bounds)]


def longest_first(jobs: Sequence[Job], routes: Sequence[Sequence[StartGoal]]) -> list[Job]:
    """The jobs in an order in which no worker begins a long one when the others have nothing left to do."""
    return sorted(jobs, key=lambda job: -max(routes[job.plan][k].geodesic_m for _, k in job.cells))


def run_job(context: Context, job: Job) -> dict[Key, Episode]:
    """One piece of work, in whatever process; each episode is told when it has ended, and before every decision how
    long its robots have walked since the last: those that walk side by side end late and all at once.

    Returns:
        The episodes that are to be filmed.
    """
    shared: Shared = context.shared
    row, plan, routes = shared.rows[job.row], shared.plans[job.plan], shared.routes[job.plan]
    clutter, config = CLUTTER[row.obstacles], row.apply(shared.config)
    setups = [draw_setup(plan, routes[k], k, seed, clutter, config) for seed, k in job.cells]
    rows = [number for number, cell in enumerate(job.cells) if cell in job.filmed]
    tell: Callable[[Episode], None] = lambda episode: context.report(job.row, episode)  # noqa: E731
    walking = len(setups)

    def end(episode: Episode) -> None:
        nonlocal walking
        walking -= 1
        if not job.at_once:
            tell(episode)

    def is_stopped() -> bool:
        context.report(job.row, walking * config.navigation_period * CONTROL_DT)
        return context.is_stopped()

    done = run_episodes(
        plan,
        setups,
        row.locomotor,
        row.navigator,
        config,
        range(len(setups)) if shared.record else rows,
        end,
        is_stopped,
    )
    if job.at_once:
        for episode in done:
            tell(episode)
    return {done[k].record.key: done[k] for k in rows}


def missing_films(wanted: Sequence[Key], films: str, seed: int, folder: Path | None) -> set[Key]:
    """The episodes to film: ``first`` of every plan, or ``all`` of the first seed, without those filmed before.

    Args:
        films: ``none``, ``first`` or ``all``.
        folder: where films may already lie; None: none does.
    """
    if films == "none":
        return set()
    chosen = {key for key in wanted if key[1] == seed and (films == "all" or key[2] == 0)}
    return {key for key in chosen if folder is None or not (folder / name_film(*key)).exists()}


def film_job(context: Context, job: FilmJob) -> str:
    """One film, in whatever process."""
    name = film(job, context.shared.config, context.is_stopped)
    context.report()
    return name
