"""What an evaluation shows: ``report.html`` of a row and of a table, self-contained, and tables in the terminal."""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

from rich.console import Console

from vinl.benchmark.metrics import aggregate_episodes
from vinl.benchmark.table import PaperFigures, TableConfig, find_comparison
from vinl.chain.metrics import FAILURES, read_failure
from vinl.chain.records import EpisodeRecord, Results
from vinl.config.loader import load_config
from vinl.config.output import describe_environment
from vinl.render.drawing import (
    POINT_DT,
    draw_histogram,
    draw_map,
    format_number,
    open_table,
    print_fitting,
    render_page,
)

_SHOWN = ("vinl", "vinl_no_clutter", "rough")
"""Rows of the paper's table that every report shows."""

_BY_PLAN = (
    ("success", "success %", 100, 1),
    ("spl", "SPL", 1, 3),
    ("foot_collisions_per_m", "foot collisions per metre", 1, 2),
)
"""Figures that the page of a table has for each floor plan: name, title, factor, digits."""

_SUMMARY = (
    ("success", "success", 100, 1),
    ("spl", "SPL", 1, 3),
    ("distance_m", "metres", 1, 2),
    ("time_s", "s", 1, 1),
    ("foot_collisions_per_m", "foot/m", 1, 2),
    ("leg_contacts_per_m", "leg/m", 1, 2),
)
"""Figures of a row in the terminal: name, title, factor, digits."""

_FAULTS = (("foot_collisions_per_m", "foot/m"), ("leg_contacts_per_m", "leg/m"), ("speed_rmse", "m/s"))


class _Row(NamedTuple):
    """One line of the table of failures or of all episodes."""

    number: int
    record: EpisodeRecord


def render_report(results: Results, command: str) -> str:
    """The page of a row as text.

    Args:
        results: what ``evaluate`` returned.
        command: shown as the way to repeat it.
    """
    rows = [_Row(k, episode.record) for k, episode in enumerate(results.episodes)]
    rules = results.config["evaluation"]
    plans = []
    for plan in results.plans:
        mine = [row.number for row in rows if row.record.plan == plan.name]
        if not mine:
            continue
        episodes = [results.episodes[k] for k in mine]
        assert mine == list(range(mine[0], mine[0] + len(mine))), "episodes of a plan stand together"
        plans.append(
            {
                "plan": plan,
                "map": draw_map(plan, episodes, mine[0], rules["success_radius"]),
                "longest": max(e.record.time_s for e in episodes),
                "aggregate": aggregate_episodes([e.record for e in episodes], rules["min_metres"]),
                "rows": [rows[k] for k in mine],
                "notes": sorted({e.record.note for e in episodes if e.record.note}),
            }
        )
    walked = [r for r in results.records if r.distance_m >= rules["min_metres"]]
    histograms = [
        draw_histogram([r.spl for r in results.records], "SPL", 0.0, 1.0),
        draw_histogram([r.distance_m for r in results.records], "distance walked [m]"),
        draw_histogram([r.time_s for r in results.records], "time [s]"),
        draw_histogram([r.foot_steps / r.distance_m for r in walked], "foot collisions per metre"),
    ]
    return render_page(
        "report.html.j2",
        _FILTERS,
        aggregate=results.aggregate,
        plans=plans,
        kinds=FAILURES,
        failures=[row for row in rows if not row.record.success],
        histograms=histograms,
        paper=_read_paper(),
        config=results.config,
        policies=results.policies,
        environment=describe_environment(),
        videos=results.videos,
        point_dt=POINT_DT,
        command=command,
        wall_seconds=results.wall_seconds,
    )


def render_table_report(data: Mapping[str, Any]) -> str:
    """The page of a table as text, from what ``summarise_table`` returned."""
    others = [name for name in data["rows"] if name != data["reference"]]
    return render_page(
        "table.html.j2",
        _FILTERS,
        data=data,
        rows=data["rows"],
        plans=[plan["name"] for plan in data["plans"]],
        plan_figures=_BY_PLAN,
        kinds=FAILURES,
        compared=[(name, *find_comparison(data, name, data["reference"])) for name in others],
        command=shlex.join(data["command"]),
        environment=data["environment"],
    )


def print_summary(console: Console, results: Results, out: Path) -> None:
    """One line a plan, one for all, and where the files lie."""
    table = open_table("plan", [*[title for _, title, _, _ in _SUMMARY], "falls", "n"])
    min_metres = results.config["evaluation"]["min_metres"]
    for plan in results.plans:
        records = [r for r in results.records if r.plan == plan.name]
        table.add_row(plan.name, *_summarise(aggregate_episodes(records, min_metres)))
    table.add_section()
    table.add_row("all", *_summarise(results.aggregate), style="bold")
    print_fitting(console, table, ("s", "leg/m", "metres"))
    success, rate = results.aggregate["success"], results.aggregate["foot_collisions_per_m"]
    console.print(
        f"success {_format_spread(success, 1, 100)} %, foot collisions {_format_spread(rate, 2)} per metre",
        soft_wrap=True,
    )
    console.print(
        f"{results.wall_seconds:.0f} s; report {out / 'report.html'}; figures {out / 'results.json'}", soft_wrap=True
    )
    for name in results.videos:
        console.print(f"film {out / name}", soft_wrap=True)


def print_table(console: Console, data: Mapping[str, Any], out: Path) -> None:
    """One line a row: the paper's figures beside ours."""
    table = open_table("row", ("success %", "f/m", "foot/m", "SPL", "falls %", "n"))
    for name, row in data["rows"].items():
        a, paper = row["aggregate"], row["paper"]
        success, feet = (f" ({paper[key][0]:.1f})" if paper else "" for key in ("success", "foot_collisions_per_m"))
        table.add_row(
            name,
            format_number(a["success"]["mean"], 1, 100) + success,
            format_number(a["paper_foot_collisions_per_m"]["mean"], 1) + feet,
            format_number(a["foot_collisions_per_m"]["mean"]),
            format_number(a["spl"]["mean"], 3),
            format_number(a["falls"], 1, 100),
            str(a["episodes"]),
        )
    print_fitting(console, table, ("n", "SPL", "f/m"))
    console.print(
        "in brackets: the paper; f/m: foot collisions per metre by its rule; foot/m: by ours, every physics step"
    )
    for name, why in data["left_out"].items():
        console.print(f"left out: row {name}: {why}", soft_wrap=True)
    console.print(f"report {out / 'report.html'}; figures {out / 'results.json'}", soft_wrap=True)


def print_faults(console: Console, data: Mapping[str, Any]) -> None:
    """One line a fault."""
    table = open_table("fault", ("success %", "falls %", *[title for _, title in _FAULTS], "more foot/m", "n"))
    for name, row in data["rows"].items():
        a, difference = row["aggregate"], row.get("difference")
        cells = [format_number(a["success"]["mean"], 1, 100), format_number(a["falls"], 1, 100)]
        cells += [format_number(a[key]["mean"]) for key, _ in _FAULTS]
        more = "" if difference is None else format_number(difference["foot_collisions_per_m"]["difference"], sign="+")
        table.add_row(name, *cells, more, str(a["episodes"]))
    print_fitting(console, table, ("n", "more foot/m"))


def format_figure(figure: Mapping[str, Any], digits: int = 2, factor: float = 1.0) -> str:
    """``mean ± deviation of the seeds``, the mean alone of one seed, or a dash."""
    spread = figure["std_over_seeds"]
    mean = format_number(figure["mean"], digits, factor)
    return mean if spread is None else f"{mean} ± {factor * spread:.{digits}f}"


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


_FILTERS = {
    "figure": format_figure,
    "interval": format_interval,
    "failure": read_failure,
    "published": format_published,
    "gain": format_gain,
}


def _read_paper() -> list[tuple[str, PaperFigures]]:
    """What the paper found, from the shipped table."""
    rows = load_config(TableConfig, "eval/table").rows
    return [(rows[name].title, paper) for name in _SHOWN if (paper := rows[name].paper) is not None]


def _summarise(aggregate: Mapping[str, Any]) -> list[str]:
    cells = [
        format_number(aggregate[key]["mean"], digits, factor, unit=" %" if factor == 100 else "")
        for key, _, factor, digits in _SUMMARY
    ]
    return [*cells, format_number(aggregate["falls"], 1, 100, unit=" %"), str(aggregate["episodes"])]


def _format_spread(figure: Mapping[str, Any], digits: int, factor: int = 1) -> str:
    """Mean, spread over seeds and interval."""
    if figure["mean"] is None:
        return "-"
    spread = "" if figure["std_over_seeds"] is None else " over seeds"
    return f"{format_figure(figure, digits, factor)}{spread} (95 %: {format_interval(figure, digits, factor)})"
