"""The page of a table, and what the terminal shows of it."""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import jinja2
from rich import box
from rich.console import Console
from rich.table import Table

from vinl.benchmark.report import format_figure
from vinl.benchmark.table import PLAN_FIGURES, find_comparison
from vinl.chain.failures import FAILURES, read_failure
from vinl.config.output import write_text

_PLAN_TITLES = dict(
    zip(
        PLAN_FIGURES,
        (
            ("success %", 100, 1),
            ("SPL", 1, 3),
            ("distance m", 1, 2),
            ("foot collisions per metre", 1, 2),
            ("foot collisions per metre by the paper's rule", 1, 2),
        ),
        strict=True,
    )
)


def render_table_report(data: Mapping[str, Any]) -> str:
    """The page as text, from what ``summarise_table`` returned."""
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("vinl.render"), autoescape=True, undefined=jinja2.StrictUndefined
    )
    environment.filters |= {
        "figure": format_figure,
        "interval": format_interval,
        "failure": read_failure,
        "published": format_published,
        "gain": format_gain,
    }
    compared = []
    for name in data["rows"]:
        if name != data["reference"]:
            entry, sign = find_comparison(data, name, data["reference"])
            compared.append((name, entry, sign))
    return environment.get_template("table.html.j2").render(
        data=data,
        rows=data["rows"],
        plans=[plan["name"] for plan in data["plans"]],
        plan_figures=[(key, *_PLAN_TITLES[key]) for key in ("success", "spl", "foot_collisions_per_m")],
        kinds=FAILURES,
        compared=compared,
        command=shlex.join(data["command"]),
    )


def write_table_report(path: Path, data: Mapping[str, Any]) -> None:
    """Write the page, whole or not at all."""
    write_text(path, render_table_report(data))


def print_table(console: Console, data: Mapping[str, Any], out: Path) -> None:
    """One line a row: the paper's figures beside ours."""
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    table.add_column("row", overflow="fold")
    for title in ("success %", "f/m", "foot/m", "SPL", "falls %", "n"):
        table.add_column(title, justify="right", no_wrap=True)
    for name, row in data["rows"].items():
        a, paper = row["aggregate"], row["paper"]
        table.add_row(
            name,
            _mean(a["success"], 1, 100) + _beside(paper, "success"),
            _mean(a["paper_foot_collisions_per_m"], 1) + _beside(paper, "foot_collisions_per_m"),
            _mean(a["foot_collisions_per_m"], 2),
            _mean(a["spl"], 3),
            f"{100 * a['falls']:.1f}",
            str(a["episodes"]),
        )
    console.print(table)
    console.print(
        "in brackets: the paper; f/m: foot collisions per metre by its rule; foot/m: by ours, every physics step"
    )
    for name, why in data["left_out"].items():
        console.print(f"left out: row {name}: {why}", soft_wrap=True)
    console.print(f"report {out / 'report.html'}; figures {out / 'results.json'}", soft_wrap=True)


def format_interval(figure: Mapping[str, Any], digits: int = 2, factor: float = 1.0) -> str:
    """The 95 % interval as ``low to high``, or a dash."""
    if figure["ci95"] is None:
        return "-"
    low, high = figure["ci95"]
    return f"{factor * low:.{digits}f} to {factor * high:.{digits}f}"


def format_published(figure: Any, digits: int = 2) -> str:
    """Mean and standard deviation as the paper prints them, or nothing."""
    return "" if not figure else f"{figure[0]:.{digits}f} ± {figure[1]:.{digits}f}"


def format_gain(figure: Mapping[str, Any], sign: int, digits: int = 2, factor: float = 1.0) -> str:
    """``difference (low to high)``, of the row that is wanted first, or a dash."""
    if figure["difference"] is None:
        return "-"
    low, high = sorted(sign * factor * value for value in figure["ci95"])
    return f"{sign * factor * figure['difference']:+z.{digits}f} ({low:+z.{digits}f} to {high:+z.{digits}f})"


def _beside(paper: Mapping[str, Any] | None, key: str) -> str:
    return f" ({paper[key][0]:.1f})" if paper else ""


def _mean(figure: Mapping[str, Any], digits: int, factor: float = 1.0) -> str:
    return "-" if figure["mean"] is None else f"{factor * figure['mean']:.{digits}f}"
