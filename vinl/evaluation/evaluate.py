"""The evaluation as a whole: plans x seeds x episodes, in worker processes."""

from __future__ import annotations

import hashlib
import json
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, Literal

from vinl.config.errors import InputError
from vinl.config.fields import closest
from vinl.config.loader import dump_config
from vinl.evaluation.config import EvaluationConfig
from vinl.evaluation.crew import Context, Crew
from vinl.evaluation.episodes import draw_routes, draw_setups
from vinl.evaluation.learned_navigator import LearnedNavigator
from vinl.evaluation.metrics import aggregate_episodes
from vinl.evaluation.navigator import ORACLE, Navigator, load_navigator
from vinl.evaluation.oracle import OracleNavigator
from vinl.evaluation.records import Episode, Results
from vinl.evaluation.rollout import run_episodes
from vinl.evaluation.senses import check_senses as check_senses
from vinl.evaluation.video import FilmJob, film
from vinl.policies.io import load_policy
from vinl.policies.policy import Policy
from vinl.world.clutter import CLUTTER, ClutterPreset
from vinl.world.floorplan import FloorPlan
from vinl.world.start_goal import StartGoal

Films = Literal["none", "first", "all"]
MAX_EPISODES, MAX_SEEDS, MAX_WORKERS = 10_000, 1_000, 1_024


@dataclass(frozen=True, eq=False)
class Job:
    """One unit of work: all start/goal pairs of a plan, with one seed."""

    plan: FloorPlan
    routes: list[StartGoal]
    seed: int
    filmed: tuple[int, ...]


@dataclass(frozen=True, eq=False)
class Shared:
    """What all units have in common."""

    locomotor: Policy
    navigator: Navigator
    clutter: ClutterPreset
    config: EvaluationConfig


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
    check_senses(policy)
    began = time.perf_counter()
    plans = _name_apart(floorplans)
    jobs = []
    for k, plan in enumerate(plans):
        on_progress("plan", k, len(plans))
        routes = draw_routes(plan, episodes, config)
        for seed in range(first_seed, first_seed + seeds):
            rows = {"none": 0, "first": 1, "all": episodes}[films] if seed == first_seed else 0
            jobs.append(Job(plan, routes, seed, tuple(range(rows))))
    shared, videos = Shared(policy, guide, CLUTTER[obstacles], config), []
    with Crew(min(workers, len(jobs)), shared) as crew:
        units = crew.run(run_job, jobs, _counter(on_progress, "walk", len(jobs) * episodes))
        if films != "none":
            assert out is not None
            shots = [
                FilmJob(job.plan, unit[k], str(out)) for job, unit in zip(jobs, units, strict=True) for k in job.filmed
            ]
            videos = crew.run(film_job, shots, _counter(on_progress, "film", len(shots)))
    done = [episode for unit in units for episode in unit]
    wall = time.perf_counter() - began
    aggregate = aggregate_episodes([e.record for e in done], config.min_metres)
    settings = {
        "evaluation": dump_config(config),
        "obstacles": {"preset": obstacles, **asdict(CLUTTER[obstacles])},
        "episodes_per_plan": episodes,
        "seeds": list(range(first_seed, first_seed + seeds)),
    }
    policies = {"locomotion": describe_policy(policy), "navigation": describe_navigator(guide)}
    return Results(done, aggregate, plans, policies, settings, wall, videos)


def run_job(context: Context, job: Job) -> list[Episode]:
    """One unit of work, in whatever process."""
    shared: Shared = context.shared
    setups = draw_setups(job.plan, job.routes, job.seed, shared.clutter, shared.config)
    return run_episodes(
        job.plan,
        setups,
        shared.locomotor,
        shared.navigator,
        shared.config,
        job.filmed,
        lambda _: context.tell(),
        context.is_stopped,
    )


def film_job(context: Context, job: FilmJob) -> str:
    """One film, in whatever process."""
    name = film(job, context.shared.config, context.is_stopped)
    context.tell()
    return name


def describe_policy(policy: Policy) -> dict[str, Any]:
    """Which policy it was: the digest tells two cards of the same name apart."""
    card = policy.card
    digest = hashlib.sha256(json.dumps(asdict(card), sort_keys=True).encode()).hexdigest()
    return {"name": card.name, "kind": card.kind, "card_sha256": digest, "samples": card.samples, "commit": card.commit}


def describe_navigator(navigator: Navigator) -> dict[str, Any]:
    """Which navigator it was: the policy, or the name alone."""
    if isinstance(navigator, LearnedNavigator):
        return describe_policy(navigator.policy)
    return {"name": ORACLE if isinstance(navigator, OracleNavigator) else type(navigator).__name__}


def _counter(on_progress: Callable[[str, int, int], None], what: str, total: int) -> Callable[[], None]:
    done = 0

    def count() -> None:
        nonlocal done
        done += 1
        on_progress(what, done, total)

    on_progress(what, 0, total)
    return count


def _name_apart(plans: Sequence[FloorPlan]) -> list[FloorPlan]:
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
