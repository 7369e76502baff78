"""``vinl eval-loco``: the locomotor alone in MuJoCo C."""

from __future__ import annotations

import os
from dataclasses import dataclass

from vinl.cli.options import parse_options
from vinl.config.errors import InputError


@dataclass(frozen=True)
class Options:
    """Let robots follow random commands and measure tracking, falls and contacts: results.json and a picture."""

    out: str
    """Folder for results.json, contacts.png (on blocks) and what --step draws."""
    policy: str | None = None
    """A shipped policy's name, or a policy folder; rough by default."""
    compare: tuple[str, ...] = ()
    """Several policies in place of --policy: all on the same courses, one table."""
    terrain: str = "flat"
    """flat, rough (the terrains of stage 1), blocks or rooms (small ones, with corners, doorways and blocks)."""
    commands: str | None = None
    """turns (0.3-1 m/s and up to 1 rad/s; the default on blocks), straight, spin (on the spot), back (0.2-0.4 m/s
    backwards), navigator (0-1 m/s and up to 60 deg/s, changed every 0.5-4 s, standing and turning on the spot included;
    the default in rooms), trained (what the policy was trained for; the default elsewhere) or forward (the same without
    sideways)."""
    robots: int = 64
    """How many robots for each policy."""
    seconds: float = 20.0
    """How long [s]."""
    seed: int = 0
    """Of terrain, starts and commands."""
    density: float = 1.0
    """Blocks per m2, for blocks and, on level 9 (fewer below), for rooms; 0 is no block under the same rules."""
    level: int | None = None
    """Level of all robots, 0 to 9, for rough and rooms; 1 to 9 by turns if not given."""
    step: bool = False
    """Also let every policy walk straight over one block: step.png (heights of the feet) and step.mp4."""
    step_height: float = 0.15
    """Height of that block [m]."""
    workers: int | None = None
    """Processes; the number of cores by default. Results do not depend on it."""
    device: str = "cpu"
    """Device of the policy: cpu or cuda."""


def main(argv: list[str]) -> int:
    """Run the evaluation and print its figures."""
    options = parse_options(Options, argv, "eval-loco")
    from rich.console import Console

    from vinl.cli.progress import Progress
    from vinl.config.output import check_out, strip_command, write_json
    from vinl.courses.courses import choose_commands
    from vinl.courses.evaluate import check_locomotor_numbers, compare_locomotors
    from vinl.courses.grounds import GroundConfig
    from vinl.courses.report import draw_contacts, label_policies, print_comparison, print_figures, results_as_dict
    from vinl.policies.io import load_policy

    if options.policy is not None and options.compare:
        raise InputError("--policy and --compare exclude each other; name all policies after --compare")
    names = list(options.compare) or [options.policy or "rough"]
    if len(set(names)) < len(names):
        raise InputError(f"--compare names a policy twice: {' '.join(names)}")
    out = check_out(options.out)
    workers = os.cpu_count() or 1 if options.workers is None else options.workers
    check_locomotor_numbers(options.robots, options.seconds, options.seed, workers)
    if not 0 < options.step_height <= 0.5:
        raise InputError(f"--step-height must lie between 0 and 0.5 m, got {options.step_height:g}")
    choose_commands(options.commands, options.terrain)
    GroundConfig(options.terrain, options.density, options.level, options.seed, 1.0, 1.0)  # refuses what it cannot draw
    policies = [load_policy(name, options.device) for name in names]
    console = Console()
    with Progress(console) as progress:
        results = compare_locomotors(
            policies,
            options.terrain,
            options.robots,
            options.seconds,
            options.seed,
            options.density,
            options.level,
            options.commands,
            workers,
            progress.show,
        )
    compared = dict(zip(label_policies(names), results, strict=True))
    data = results_as_dict(compared, ["vinl", "eval-loco", *strip_command(argv)], workers)
    write_json(out / "results.json", data)
    if options.terrain == "blocks" and options.density > 0:
        draw_contacts(compared, out / "contacts.png")
    if options.compare:
        print_comparison(console, compared)
    else:
        print_figures(console, results[0])
    if options.step:
        from vinl.courses.crossing import cross_block, describe_steps, draw_steps
        from vinl.courses.crossing_film import film_steps

        ways = {name: cross_block(p, options.step_height) for name, p in zip(compared, policies, strict=True)}
        draw_steps(ways, options.step_height, out / "step.png")
        film_steps(ways, options.step_height, out / "step.mp4")
        for name, crossings in ways.items():
            console.print(f"{name}: {describe_steps(crossings)}", soft_wrap=True, highlight=False)
        console.print(f"one block: {out / 'step.png'}, {out / 'step.mp4'}", soft_wrap=True)
    console.print(f"{results[0].wall_seconds:.0f} s; figures {out / 'results.json'}", soft_wrap=True)
    return 0
