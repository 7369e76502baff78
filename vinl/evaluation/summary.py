"""The table that the terminal shows after an evaluation."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from vinl.evaluation.metrics import aggregate_episodes
from vinl.evaluation.records import Results

_COLUMNS = (
    ("success", "success %", 100, 1),
    ("spl", "SPL", 1, 3),
    ("distance_m", "distance m", 1, 2),
    ("time_s", "time s", 1, 1),
    ("foot_collisions_per_m", "foot coll. /m", 1, 2),
    ("leg_contacts_per_m", "leg cont. /m", 1, 2),
)


def print_summary(console: Console, results: Results, out: Path) -> None:
    """One row a plan, one for all, and where the files lie."""
    table = Table("plan", *[title for _, title, _, _ in _COLUMNS], "falls", "episodes")
    min_metres = results.config["evaluation"]["min_metres"]
    for plan in results.plans:
        records = [r for r in results.records if r.plan == plan.name]
        table.add_row(plan.name, *_cells(aggregate_episodes(records, min_metres)))
    table.add_section()
    table.add_row("all", *_cells(results.aggregate), style="bold")
    console.print(table)
    console.print(f"{results.wall_seconds:.0f} s; report {out / 'report.html'}; figures {out / 'results.json'}", soft_wrap=True)
    for name in results.videos:
        console.print(f"film {out / name}", soft_wrap=True)


def _cells(aggregate: dict[str, Any]) -> list[str]:
    cells = []
    for key, _, factor, digits in _COLUMNS:
        mean, std = aggregate[key]["mean"], aggregate[key]["std_over_seeds"]
        cells.append("-" if mean is None else f"{factor * mean:.{digits}f} ± {factor * std:.{digits}f}")
    falls = "-" if aggregate["falls"] is None else f"{100 * aggregate['falls']:.1f} %"
    return [*cells, falls, str(aggregate["episodes"])]
