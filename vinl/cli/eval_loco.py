"""``vinl eval-loco``: the locomotor alone in MuJoCo C."""

from __future__ import annotations

import os
from dataclasses import asdict, dataclass

from vinl.cli.options import parse_options


@dataclass(frozen=True)
class Options:
    """Let robots follow random commands, held 5-10 s, and measure tracking, falls and contacts: results.json."""

    out: str
    """Folder for results.json."""
    policy: str = "rough"
    """A shipped policy's name, or a policy folder."""
    terrain: str = "flat"
    """flat, rough (the terrains of stage 1) or blocks."""
    robots: int = 64
    """How many robots."""
    seconds: float = 20.0
    """How long [s]."""
    seed: int = 0
    """Of terrain, starts and commands."""
    density: float = 1.0
    """Blocks per m2, for blocks."""
    level: int | None = None
    """Level of all robots, 0 to 9, for rough; 1 to 9 by turns if not given."""
    forward_only: bool = False
    """No sideways velocities: only forward (or back) and turning, as a navigator commands."""
    workers: int | None = None
    """Processes; the number of cores by default. Results do not depend on it."""
    device: str = "cpu"
    """Device of the policy: cpu or cuda."""


def main(argv: list[str]) -> int:
    """Run the evaluation and print its figures."""
    options = parse_options(Options, argv, "eval-loco")
    from rich.console import Console
    from rich.table import Table

    from vinl.evaluation.grounds import GroundConfig
    from vinl.evaluation.locomotor import check_locomotor_numbers, evaluate_locomotor
    from vinl.evaluation.progress import Progress
    from vinl.evaluation.results_file import SCHEMA, check_out, describe_environment, strip_command, write_json
    from vinl.policies.io import load_policy

    out = check_out(options.out)
    workers = os.cpu_count() or 1 if options.workers is None else options.workers
    check_locomotor_numbers(options.robots, options.seconds, options.seed, workers)
    GroundConfig(options.terrain, options.density, options.level, options.seed, 1.0, 1.0)  # refuses what it cannot draw
    policy = load_policy(options.policy, options.device)
    console = Console()
    with Progress(console) as progress:
        results = evaluate_locomotor(
            policy,
            options.terrain,
            options.robots,
            options.seconds,
            options.seed,
            options.density,
            options.level,
            options.forward_only,
            workers,
            progress.show,
        )
    wall = round(results.wall_seconds, 2)
    data = {
        "schema": SCHEMA,
        "command": ["vinl", "eval-loco", *strip_command(argv)],
        "config": results.config,
        "policies": results.policies,
        "environment": describe_environment(),
        "aggregate": results.aggregate,
        "robots": [asdict(record) for record in results.robots],
        "timing": {"wall_seconds": wall, "workers": workers},
    }
    write_json(out / "results.json", data)
    table = Table("figure", "value", show_header=False)
    for key, value in results.aggregate.items():
        if not isinstance(value, dict) and value is not None:
            table.add_row(key, f"{value:.4g}")
    console.print(table)
    console.print(f"{wall:.0f} s; figures {out / 'results.json'}", soft_wrap=True)
    return 0
