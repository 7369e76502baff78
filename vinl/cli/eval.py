"""``vinl eval``: the whole chain in MuJoCo C."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from vinl.cli.imports import kept_imports
from vinl.cli.options import Settings, default_out, load_rules, parse_options, settings_first
from vinl.config.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Callable

    from rich.console import Console

    from vinl.benchmark.protocol import Protocol, Row
    from vinl.chain.config import EvaluationConfig
    from vinl.chain.records import Results


@dataclass(frozen=True)
class Options:
    """Walk a robot through floor plans and measure how it went: results.json, report.html and films."""

    overrides: Settings = ()
    """Rules of the episodes in place of the config's, for example time_limit=60."""
    out: str | None = None
    """Folder for results.json, report.html and films (default: runs/eval- and who walks)."""
    floorplans: tuple[str, ...] = ()
    """Files (.png, .pgm, ROS .yaml, ProcTHOR .json or .jsonl.gz:17) or names of shipped plans; all shipped ones by
    default."""
    loco: str | None = None
    """Locomotion policy: a shipped one's name, a policy folder or a training run (default: loco)."""
    nav: str | None = None
    """Navigation policy: a shipped one's name, a policy folder, a training run, or oracle, which follows the shortest
    way (default: nav). With --table it takes the place of the learned one of all rows."""
    episodes: int = 10
    """Start/goal pairs in each plan; the same for all seeds."""
    routes: str | None = None
    """YAML file with start/goal pairs of your own in place of drawn ones: PLAN: [{start: [x, y], goal: [x, y]}]."""
    seeds: int = 5
    """Repetitions: a seed changes clutter, heading and joint angles at the start."""
    first_seed: int = 0
    """The first of the seeds."""
    recovery: bool = False
    """Free the robots of a learned navigator where they are stuck: they back up, turn away and walk on. No part of any
    policy."""
    obstacles: str | None = None
    """Clutter: none, paper or dense (default: paper)."""
    table: bool = False
    """Walk all rows of a table instead of one robot, each the same episodes, beside the paper's figures."""
    table_file: str = "eval/table"
    """Rows of the table: a shipped config or a YAML file."""
    faults: bool = False
    """Walk the same episodes again with each of a matrix of faults (late motors, noisy sensors ...), one at a time,
    beside the ideal robot. For a single setting without --faults: faults.action_delay=0.02, sensors.pixels=0.05."""
    faults_file: str = "eval/faults"
    """The faults: a shipped config or a YAML file."""
    rows: tuple[str, ...] = ()
    """Only these rows of the table or of the faults."""
    strict: bool = False
    """A row whose policy is not there is an error; otherwise it is left out, which the table says."""
    video: bool = False
    """Film the first episode of every plan."""
    video_all: bool = False
    """Film all episodes of the first seed."""
    record: bool = False
    """Keep the poses of all episodes, about 1 kB for each second, for vinl play --replay."""
    workers: int | None = None
    """Processes; the number of cores by default, on a cluster that of all its CPUs. Results do not depend on it."""
    cluster: str | None = None
    """Walk on a Ray cluster: its address (host:port, ray://host:port, auto), or local for one that is started here;
    needs the cluster extra. Results do not depend on it where processors and versions are the same."""
    fresh: bool = False
    """Begin anew: forget what an earlier run left in the folder. Otherwise the same command goes on where it was
    interrupted."""
    device: str = "auto"
    """Of the policies: cpu, cuda, or auto: cpu, the only one that repeats bit for bit."""
    resolution: float | None = None
    """Metres per pixel of floor plans that are bare pictures; 0.05 if not given."""
    min_speck: int = 0
    """Pieces of wall of fewer pixels than this are dropped from pictures and ROS maps."""
    sensors: str | None = None
    """Errors of the depth cameras: ideal (none, the default), realistic (a stereo camera: noise, holes, delay, a mount
    that is a little off), or a YAML file like configs/sensors/realistic.yaml."""
    drift: float | None = None
    """A learned navigator knows where it is from its own motion alone, and measures distances too long or too short by
    this fraction (0.02: 2 %; default: 0); its heading drifts too, by up to 0.1 rad times this a metre. It arrives where
    the goal is."""
    config: str = "eval/default"
    """Rules of the episodes: a shipped config or a YAML file."""


def main(argv: list[str]) -> int:
    """Run the evaluation and print where its files lie."""
    options = parse_options(Options, settings_first(Options, argv), "eval")
    with kept_imports():
        from vinl.benchmark.evaluate import check_numbers, name_apart
        from vinl.benchmark.folders import check_folder
        from vinl.benchmark.protocol import Films, Protocol
        from vinl.benchmark.routes import read_routes
        from vinl.chain.choose import best_locomotor, best_navigator
        from vinl.config.output import check_out, strip_command
        from vinl.world.readers import load_floorplans

    many = "table" if options.table else "faults" if options.faults else ""
    who = (many,) if many else (options.loco or best_locomotor(), options.nav or best_navigator())
    out = check_out(default_out("eval", *who) if options.out is None else options.out)
    films: Films = "all" if options.video_all else "first" if options.video else "none"
    workers = 1 if options.workers is None else options.workers
    check_numbers(options.episodes, options.seeds, options.first_seed, options.obstacles or "paper", workers)
    if options.faults and options.table:
        raise InputError("--faults does not go with --table; evaluate them one after the other")
    if options.cluster is not None and options.device == "cuda":
        raise InputError("--cluster asks policies on CPUs; leave --device cuda out")
    check_folder(out, bool(many))
    config = _load_rules(options)

    def prepare() -> Protocol:
        plans = load_floorplans(options.floorplans, options.resolution, options.min_speck)
        if not plans:
            raise InputError("no floor plan is shipped with this version; give files: --floorplans FILE")
        seeds = range(options.first_seed, options.first_seed + options.seeds)
        named, episodes, routes = name_apart(plans), options.episodes, None
        if options.routes is not None:
            routes = read_routes(Path(options.routes), named)
            episodes = len(next(iter(routes.values())))
        return Protocol(named, episodes, seeds, config, films, routes, options.record)

    command = ["vinl", "eval", *strip_command(argv)]
    run = _run_table if options.table else _run_faults if options.faults else _run_one
    run(options, out, prepare, command)
    return 0


def _run_one(options: Options, out: Path, prepare: Callable[[], Protocol], command: list[str]) -> None:
    from rich.console import Console

    from vinl.benchmark.folders import write_run
    from vinl.benchmark.report import print_summary

    if options.rows or options.strict:
        raise InputError("--rows and --strict belong to a table; give --table (or --faults, which has rows) too")
    row = _load_single(options)
    protocol, console = prepare(), Console()
    results = _walk([row], protocol, [out], options, command, console, out)[0]
    write_run(out, results, command)
    print_summary(console, results, out)


def _run_faults(options: Options, out: Path, prepare: Callable[[], Protocol], command: list[str]) -> None:
    from rich.console import Console

    from vinl.benchmark.folders import RESULTS_FILE, write_run
    from vinl.benchmark.report import print_faults
    from vinl.benchmark.table import FaultMatrix, summarise_faults
    from vinl.config.loader import load_config
    from vinl.config.output import write_json

    if options.strict:
        raise InputError("--strict belongs to a table; give --table too")
    faults = load_config(FaultMatrix, options.faults_file).choose(options.rows)
    row = _load_single(options)
    protocol, console = prepare(), Console()
    if not protocol.config.faults.is_neutral:
        raise InputError("--faults tries one fault at a time; leave the group faults of the config as it is")
    rows = [replace(row, settings=settings) for settings in faults.values()]
    folders = [out / name for name in faults]
    results = _walk(rows, protocol, folders, options, command, console, out)
    for folder, one in zip(folders, results, strict=True):
        write_run(folder, one, command)
    data = summarise_faults(faults, results, command, protocol.config.min_metres)
    write_json(out / RESULTS_FILE, data)
    print_faults(console, data)
    console.print(f"figures {out / RESULTS_FILE}, each fault's in the folder of its name", soft_wrap=True)


def _run_table(options: Options, out: Path, prepare: Callable[[], Protocol], command: list[str]) -> None:
    from rich.console import Console

    from vinl.benchmark.folders import keep_table, leave_out, write_table
    from vinl.benchmark.report import print_table
    from vinl.benchmark.table import Table, TableConfig, TableRow
    from vinl.config.loader import load_config

    for name in ("loco", "obstacles", "recovery"):
        if getattr(options, name):
            raise InputError(f"--{name} does not go with --table: its rows say who walks, through what clutter")
    table = load_config(TableConfig, options.table_file).choose(options.rows, options.nav)
    present, left_out = leave_out(table, options.strict)
    loaded = [_load_row(row.loco, row.nav, row.obstacles, row.recovery, options) for row in present.values()]
    protocol, console = prepare(), Console()
    for name, why in left_out.items():
        console.print(f"left out: row {name}: {why}", soft_wrap=True)
    reference = table.reference if table.reference in present else next(iter(present))
    out.mkdir(parents=True, exist_ok=True)
    keep_table(out, table, left_out, command)
    folders = [out / name for name in present]
    done = _walk(loaded, protocol, folders, options, command, console, out)
    walked = zip(present.items(), done, strict=True)
    rows = [TableRow(name, row.title, results, row.paper) for (name, row), results in walked]
    print_table(console, write_table(out, Table(rows, reference, left_out, command)), out)


def _load_single(options: Options) -> Row:
    """Who walks without a table."""
    from vinl.chain.choose import best_locomotor, best_navigator

    loco, nav = options.loco or best_locomotor(), options.nav or best_navigator()
    return _load_row(loco, nav, options.obstacles or "paper", options.recovery, options)


def _load_row(loco: str, nav: str, obstacles: str, recovery: bool, options: Options) -> Row:
    from vinl.benchmark.protocol import Row
    from vinl.chain.choose import load_navigator
    from vinl.policies.io import load_policy

    config = _load_rules(options)
    return Row(load_policy(loco, options.device), load_navigator(nav, config, options.device, recovery), obstacles)


def _load_rules(options: Options) -> EvaluationConfig:
    return load_rules(options.config, options.overrides, options.sensors, options.drift)


def _walk(
    rows: list[Row],
    protocol: Protocol,
    folders: list[Path],
    options: Options,
    command: list[str],
    console: Console,
    out: Path,
) -> list[Results]:
    from vinl.benchmark.evaluate import evaluate_rows
    from vinl.cli.progress import Progress

    kept = f"{out} keeps them; the same command goes on from there"
    # the folder may be there already, and hold the plans or episodes of before
    with Progress(console, kept, f"no episode was added to {out}; the same command goes on") as progress:
        return evaluate_rows(
            rows, protocol, options.workers, folders, True, options.fresh, command, progress.show, options.cluster
        )
