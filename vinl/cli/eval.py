"""``vinl eval``: the whole chain in MuJoCo C."""

from __future__ import annotations

import os
import shlex
from dataclasses import dataclass
from typing import Annotated

import tyro

from vinl.cli.options import parse_options
from vinl.config.errors import InputError


@dataclass(frozen=True)
class Options:
    """Walk a robot through floor plans and measure how it went: results.json, report.html and films."""

    out: str
    """Folder for results.json, report.html and films."""
    floorplans: tuple[str, ...] = ()
    """Files (.png, .pgm, ROS .yaml, ProcTHOR .json or .jsonl.gz:17) or names of shipped plans; all shipped ones by
    default."""
    loco: str = "rough"
    """Locomotor: a shipped policy's name, or a policy folder."""
    nav: str = "oracle"
    """Navigator: oracle (follows the shortest way), a shipped navigation policy's name, or a policy folder."""
    episodes: int = 10
    """Start/goal pairs in each plan; the same for all seeds."""
    seeds: int = 5
    """Repetitions: a seed changes clutter, heading and joint angles at the start."""
    first_seed: int = 0
    """The first of the seeds."""
    obstacles: str = "none"
    """Clutter: none, paper or dense."""
    video: bool = False
    """Film the first episode of every plan."""
    video_all: bool = False
    """Film all episodes of the first seed."""
    workers: int | None = None
    """Processes; the number of cores by default. Results do not depend on it."""
    shard: str = "1/1"
    """Which share of the episodes is walked here, for example 2/5: the second of five. ``vinl report`` puts the folders
    of all shares together."""
    fresh: bool = False
    """Begin anew: forget what an earlier run left in the folder. Otherwise the same command goes on where it was
    interrupted."""
    device: str = "cpu"
    """Device of the policies: cpu or cuda. Only cpu repeats bit for bit."""
    resolution: float | None = None
    """Metres per pixel of floor plans that are bare pictures; 0.05 if not given."""
    min_speck: int = 0
    """Pieces of wall of fewer pixels than this are dropped from pictures and ROS maps."""
    config: str = "eval/default"
    """Rules of the episodes: a shipped config or a YAML file."""
    set: Annotated[tuple[str, ...], tyro.conf.arg(metavar="KEY=VALUE")] = ()
    """Changes to the config, for example time_limit=60."""


def main(argv: list[str]) -> int:
    """Run the evaluation and print where its files lie."""
    options = parse_options(Options, argv, "eval")
    from rich.console import Console

    from vinl.config.loader import load_config
    from vinl.evaluation.config import EvaluationConfig
    from vinl.evaluation.evaluate import Films, Protocol, check_numbers, evaluate_rows, name_apart
    from vinl.evaluation.navigator import load_navigator
    from vinl.evaluation.progress import Progress
    from vinl.evaluation.report import write_report
    from vinl.evaluation.results_file import check_out, results_as_dict, strip_command, write_json
    from vinl.evaluation.summary import print_summary
    from vinl.evaluation.work import Row, Shard
    from vinl.policies.io import load_policy
    from vinl.world.readers import load_floorplans

    out = check_out(options.out)
    workers = os.cpu_count() or 1 if options.workers is None else options.workers
    films: Films = "all" if options.video_all else "first" if options.video else "none"
    check_numbers(options.episodes, options.seeds, options.first_seed, options.obstacles, workers)
    shard = Shard.parse(options.shard)
    config = load_config(EvaluationConfig, options.config, options.set)
    policy = load_policy(options.loco, options.device)
    navigator = load_navigator(options.nav, config, options.device)
    plans = load_floorplans(options.floorplans, options.resolution, options.min_speck)
    if not plans:
        raise InputError("no floor plan is shipped with this version; give files: --floorplans FILE")
    seeds = range(options.first_seed, options.first_seed + options.seeds)
    protocol = Protocol(name_apart(plans), options.episodes, seeds, config, shard, films)
    row = Row(policy, navigator, options.obstacles)
    command = ["vinl", "eval", *strip_command(argv)]
    console = Console()
    with Progress(console, f"{out} keeps them; the same command goes on from there") as progress:
        results = evaluate_rows([row], protocol, workers, [out], True, options.fresh, command, progress.show)[0]
    write_json(out / "results.json", results_as_dict(results, command, workers, shard))
    write_report(out / "report.html", results, shlex.join(command))
    print_summary(console, results, out)
    return 0
