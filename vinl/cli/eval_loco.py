"""``vinl eval-loco``: the low-level locomotion policy alone in MuJoCo C."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from vinl.cli.options import default_out, parse_options
from vinl.config.errors import InputError

_BARS = {"height": (0.1,), "depth": 0.2, "speed": 0.5, "crossings": 32}
"""Options of bars alone, and what they are if not given."""

_COURSES = {"commands": None, "robots": 64, "seconds": 20.0, "density": None, "level": None}
"""Options of all other terrains."""


@dataclass(frozen=True)
class Options:
    """Let robots walk on level floor, rough ground, blocks, litter or bars; measure tracking, falls and contacts."""

    out: str | None = None
    """Folder for results.json, contacts.png (on blocks) and what --video films (default: runs/eval-loco- and the
    policies, and a number where that holds the results of another command)."""
    policy: str | None = None
    """A shipped policy's name, or a policy folder or training run (default: loco)."""
    compare: tuple[str, ...] = ()
    """Several policies in place of --policy: all on the same courses, one table."""
    terrain: str = "flat"
    """flat, rough (the terrains of stage 1), blocks, litter (objects of 5-15 cm, 3-10 cm high), rooms (small ones, with
    corners, doorways and blocks) or bars (a corridor 1 m wide with a bar across it: no way around)."""
    height: tuple[float, ...] | None = None
    """Heights of the bars [m], one after another; 0.1 if not given."""
    depth: float | None = None
    """Depth of the bars, along the corridor [m]; 0.2 if not given."""
    speed: float | None = None
    """Forward speed over bars [m/s]; 0.5 if not given. Robots are steered along the middle by yaw rates."""
    crossings: int | None = None
    """Crossings of each policy at each height of the bars, from starts at other distances; 32 if not given."""
    commands: str | None = None
    """home (0.3-0.8 m/s and up to 0.6 rad/s; the default on blocks), steady (0.4 m/s straight on; the default on
    litter), turns (0.3-1 m/s and up to 1 rad/s), straight, spin (on the spot), back (0.2-0.4 m/s backwards), navigator
    (0-1 m/s and up to 60 deg/s, changed every 0.5-4 s, standing and turning on the spot included; the default in
    rooms), trained (what the policy was trained for; the default elsewhere) or forward (the same without sideways)."""
    robots: int | None = None
    """How many robots for each policy; 64 if not given."""
    seconds: float | None = None
    """How long [s]; 20 if not given."""
    seed: int = 0
    """Of terrain, starts and commands."""
    density: float | None = None
    """Blocks (1 if not given) or objects of litter (10) per m2; in rooms of level 9, fewer below. 0 is none under the
    same rules."""
    level: int | None = None
    """Level of all robots, 0 to 9, for rough and rooms; 1 to 9 by turns if not given."""
    video: bool = False
    """Film the first crossing of every bar from the side (bar_10cm.mp4), and draw the heights of the feet in the first
    eight (bar_10cm.png)."""
    workers: int | None = None
    """Processes; the number of cores by default. Results do not depend on it."""
    device: str = "auto"
    """Of the policies: cpu, cuda, or auto: cpu, the only one that repeats bit for bit."""


def main(argv: list[str]) -> int:
    """Run the evaluation and print its figures."""
    options = parse_options(Options, argv, "eval-loco")
    from vinl.chain.choose import best_locomotor
    from vinl.config.loader import closest
    from vinl.config.output import choose_out, strip_command
    from vinl.courses.grounds import TERRAINS

    if options.policy is not None and options.compare:
        raise InputError("--policy and --compare exclude each other; name all policies after --compare")
    names = list(options.compare) or [options.policy or best_locomotor()]
    if len(set(names)) < len(names):
        raise InputError(f"--compare names a policy twice: {' '.join(names)}")
    known = (*TERRAINS, "bars")
    if options.terrain not in known:
        meant = closest(options.terrain, known)
        raise InputError(f"--terrain {options.terrain!r} is unknown{meant}; known: {', '.join(known)}")
    foreign = _COURSES if options.terrain == "bars" else {**_BARS, "video": False}
    for name in foreign:
        if getattr(options, name) is not None and getattr(options, name) is not False:
            where = "is not for --terrain bars" if name in _COURSES else "is for --terrain bars alone"
            raise InputError(f"--{name} {where}")
    command = ["vinl", "eval-loco", *strip_command(argv)]
    out = choose_out(options.out, default_out("eval-loco", *names[:3]), command)
    _run(options, names, out, command)
    return 0


def _run(options: Options, names: list[str], out: Path, command: list[str]) -> None:
    from rich.console import Console

    from vinl.cli.progress import Progress
    from vinl.config.output import write_json
    from vinl.courses import report
    from vinl.courses.evaluate import compare_locomotors
    from vinl.courses.evaluate_crossings import compare_crossings
    from vinl.policies.io import load_policy

    terrain, seed, bars = options.terrain, options.seed, options.terrain == "bars"
    chosen = dict(_BARS if bars else _COURSES)
    chosen |= {name: value for name in chosen if (value := getattr(options, name)) is not None}
    policies, console = [load_policy(name, options.device) for name in names], Console()
    workers = os.cpu_count() or 1 if options.workers is None else options.workers
    results: list[Any]
    with Progress(console) as progress:
        if bars:
            heights = chosen.pop("height")
            results = compare_crossings(
                policies, heights, **chosen, seed=seed, traced=options.video, workers=workers, on_progress=progress.show
            )
        else:
            results = compare_locomotors(
                policies, terrain, **chosen, seed=seed, workers=workers, on_progress=progress.show
            )
    compared = dict(zip(report.label_policies(names), results, strict=True))
    write_json(out / "results.json", report.results_as_dict(compared, command, workers))
    if options.video:
        report.picture_crossings(compared, out)
    if terrain == "blocks" and results[0].config["ground"]["density"] > 0:
        report.draw_contacts(compared, out / "contacts.png")
    if bars:
        report.print_crossings(console, compared)
    elif options.compare:
        report.print_comparison(console, compared)
    else:
        report.print_figures(console, results[0])
    console.print(f"{results[0].wall_seconds:.0f} s; figures {out / 'results.json'}", soft_wrap=True)
