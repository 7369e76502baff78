"""The table that the terminal shows after an evaluation."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from rich import box
from rich.console import Console
from rich.table import Table

from vinl.benchmark.metrics import aggregate_episodes
from vinl.chain.records import Results

_COLUMNS = (
    ("success", "success", 100, 1),
    ("spl", "SPL", 1, 3),
    ("distance_m", "metres", 1, 2),
    ("time_s", "s", 1, 1),
    ("foot_collisions_per_m", "foot/m", 1, 2),
    ("leg_contacts_per_m", "leg/m", 1, 2),
)


def print_summary(console: Console, results: Results, out: Path) -> None:
    """One row a plan, one for all, and where the files lie."""
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    table.add_column("plan", overflow="fold")
    for title in (*[title for _, title, _, _ in _COLUMNS], "falls", "n"):
        table.add_column(title, justify="right", no_wrap=True)
    min_metres = results.config["evaluation"]["min_metres"]
    for plan in results.plans:
        records = [r for r in results.records if r.plan == plan.name]
        table.add_row(plan.name, *_cells(aggregate_episodes(records, min_metres)))
    table.add_section()
    table.add_row("all", *_cells(results.aggregate), style="bold")
    console.print(table)
    success, rate = results.aggregate["success"], results.aggregate["foot_collisions_per_m"]
    console.print(
        f"success {_interval(success, 100, 1)} %, foot collisions {_interval(rate, 1, 2)} per metre", soft_wrap=True
    )
    console.print(
        f"{results.wall_seconds:.0f} s; report {out / 'report.html'}; figures {out / 'results.json'}", soft_wrap=True
    )
    for name in results.videos:
        console.print(f"film {out / name}", soft_wrap=True)


def _cells(aggregate: dict[str, Any]) -> list[str]:
    cells = []
    for key, _, factor, digits in _COLUMNS:
        mean = aggregate[key]["mean"]
        cells.append("-" if mean is None else f"{factor * mean:.{digits}f}{' %' if factor == 100 else ''}")
    falls = "-" if aggregate["falls"] is None else f"{100 * aggregate['falls']:.1f} %"
    return [*cells, falls, str(aggregate["episodes"])]


def _interval(figure: dict[str, Any], factor: int, digits: int) -> str:
    if figure["mean"] is None:
        return "-"
    mean, std, (low, high) = figure["mean"], figure["std_over_seeds"], figure["ci95"]
    spread = "" if std is None else f"± {factor * std:.{digits}f} over seeds "
    return f"{factor * mean:.{digits}f} {spread}(95 %: {factor * low:.{digits}f} to {factor * high:.{digits}f})"
