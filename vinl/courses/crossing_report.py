"""What the crossings of bars leave behind: a table in the terminal, ``results.json``, films and drawings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from rich import box
from rich.console import Console
from rich.table import Table

from vinl.config.output import SCHEMA
from vinl.config.versions import describe_environment
from vinl.courses.crossing import CrossingRecord
from vinl.courses.crossing_film import film_crossings
from vinl.courses.crossing_plot import draw_feet
from vinl.courses.evaluate_crossings import CrossingResults
from vinl.courses.report import print_gait
from vinl.courses.robot_records import round_figures

_FRACTIONS = (
    ("clean_foot_crossings", "no foot"),
    ("clean_leg_crossings", "no leg"),
    ("clean_crossings", "clean"),
    ("finished", "across"),
    ("falls", "fell"),
)
"""Columns in per cent."""

_MEANS = (
    ("foot_steps_per_crossing", "feet"),
    ("leg_steps_per_crossing", "legs"),
)
"""Columns in control steps on the bar per crossing."""


def print_crossings(console: Console, compared: Mapping[str, CrossingResults]) -> None:
    """One row for each policy and height, in per cent of the crossings with the half-width of the interval, then
    control steps on the bar per crossing."""
    first = next(iter(compared.values())).config
    title = (
        f"{first['crossings']} crossings each, bar {first['depth']:g} m deep, {first['speed']:g} m/s: % of the "
        "crossings; control steps on the bar"
    )
    table = Table(title=title, title_justify="left", box=box.SIMPLE_HEAD, pad_edge=False)
    table.add_column("policy", overflow="fold", min_width=9)
    for name in ("cm", *[t for _, t in _FRACTIONS], *[t for _, t in _MEANS]):
        table.add_column(name, justify="right", no_wrap=True)
    for name, results in compared.items():
        for height, figures in results.aggregate["by_height"].items():
            fractions = [_percent(figures, key) for key, _ in _FRACTIONS]
            means = [f"{figures[key]:.1f}" for key, _ in _MEANS]
            table.add_row(name, f"{100 * float(height):g}", *fractions, *means)
    console.print(table)
    print_gait(console, {name: results.aggregate for name, results in compared.items()})


def _percent(figures: Mapping[str, Any], key: str) -> str:
    low, high = figures["ci95"][key]
    return f"{100 * figures[key]:.0f} ±{50 * (high - low):.0f}"


def crossings_as_dict(compared: Mapping[str, CrossingResults], command: Sequence[str], workers: int) -> dict[str, Any]:
    """Results as plain data. One policy alone has its figures in ``aggregate``; of several each has its own in
    ``compared``, and every crossing's record names its policy."""
    first = next(iter(compared.values()))
    data: dict[str, Any] = {"schema": SCHEMA, "command": list(command), "config": first.config}
    data["environment"] = describe_environment()
    if len(compared) == 1:
        data |= {"policies": first.policies, "aggregate": first.aggregate}
        data["crossings"] = [_plain(record) for record in first.records]
    else:
        data["compared"] = {
            name: {"policies": r.policies, "gains": r.config["gains"], "aggregate": r.aggregate}
            for name, r in compared.items()
        }
        data["crossings"] = [{"policy": name, **_plain(record)} for name, r in compared.items() for record in r.records]
    data["timing"] = {"wall_seconds": round(first.wall_seconds, 2), "workers": workers}
    return data


def _plain(record: CrossingRecord) -> dict[str, Any]:
    return round_figures(asdict(record))


def picture_crossings(compared: Mapping[str, CrossingResults], out: Path) -> None:
    """A film and a drawing for each height, of crossings that were traced."""
    for height in next(iter(compared.values())).config["heights"]:
        traces = {name: results.traces[height] for name, results in compared.items()}
        depth = next(iter(compared.values())).config["depth"]
        name = f"bar_{100 * height:g}cm"
        draw_feet(traces, height, depth, out / f"{name}.png")
        film_crossings({name: some[0] for name, some in traces.items()}, height, depth, out / f"{name}.mp4")
