"""What a trial of locomotion policies leaves behind: tables in the terminal, results.json and pictures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console

from vinl.config.output import SCHEMA, describe_environment, round_numbers
from vinl.config.words import count_things
from vinl.courses.crossing import CrossingRecord
from vinl.courses.crossing_pictures import draw_feet, film_crossings
from vinl.courses.evaluate import TrialResults
from vinl.courses.evaluate_crossings import CrossingResults
from vinl.courses.robot_records import HEIGHT_NAMES, RobotRecord
from vinl.render.drawing import format_number, open_table, print_fitting

_COLUMNS = (
    ("foot_block_per_m", "feet on\nblocks/m", 2),
    ("foot_front_block_per_m", "front\nfeet", 2),
    ("foot_rear_block_per_m", "rear\nfeet", 2),
    ("leg_block_per_m", "legs on\nblocks/m", 2),
    ("linear_velocity_rmse", "speed\nerror\nm/s", 3),
    ("yaw_rate_rmse", "turn\nerror\nrad/s", 3),
    ("trunk_over_blocks", "trunk\nover", 2),
)
"""Figures of the table: name, title, digits."""

_LITTER_COLUMNS = (
    ("dirty_steps", "dirty\nsteps %", 1),
    ("dirty_foot_steps", "dirty by\nfoot %", 1),
    ("foot_block_per_m", "feet on\nblocks/m", 1),
    ("leg_block_per_m", "legs on\nblocks/m", 1),
    ("linear_velocity_rmse", "speed\nerror\nm/s", 3),
)
"""The same for litter; fractions of steps in per cent."""

_SPARED = (
    "foot_rear_block_per_m",
    "foot_front_block_per_m",
    "trunk_over_blocks",
    "yaw_rate_rmse",
    "leg_block_per_m",
    "linear_velocity_rmse",
)
"""What a narrow terminal does without, the least important figure first."""

_GAIT = (
    ("cost_of_transport", "CoT", 1, 2),
    ("leg_leg_per_m", "leg-leg/m", 1, 2),
    ("joint_overspeed", "fast %", 100, 2),
    ("joint_speed_peak", "peak", 1, 2),
    ("feet_close", "close %", 100, 2),
    ("foot_distance_min", "gap m", 1, 3),
    ("foot_above_hip", "high %", 100, 2),
)
"""Figures of the gait: name, title, factor, digits."""

_GAIT_WORDS = (
    "CoT: cost of transport; leg-leg: steps with a leg on a leg; steps with a joint too fast, feet close, a foot above "
    "its hip; peak: fastest joint, in its limit; gap: least between two feet"
)

_SPREAD = ("foot_block_per_m", "leg_block_per_m", "dirty_steps", "dirty_foot_steps")
"""Figures whose interval the table shows, as half its width."""

_BARS = (
    ("foot_front_block_per_m", "front feet"),
    ("foot_rear_block_per_m", "rear feet"),
    ("leg_front_block_per_m", "front legs"),
    ("leg_rear_block_per_m", "rear legs"),
)


_FRACTIONS = (
    ("clean_foot_crossings", "no foot"),
    ("clean_leg_crossings", "no leg"),
    ("clean_crossings", "clean"),
    ("finished", "across"),
    ("falls", "fell"),
)
"""Columns in per cent."""

_MEANS = (("foot_steps_per_crossing", "feet"), ("leg_steps_per_crossing", "legs"))
"""Columns in control steps on the bar per crossing."""


def label_policies(names: Sequence[str]) -> list[str]:
    """Short names for a table: of a folder its last part, of a run's ``policy`` folder the run's; whole if unclear."""
    paths = [Path(name) for name in names]
    short = [(p.parent.name if p.name == "policy" else p.name) or str(p) for p in paths]
    return [s if short.count(s) == 1 else name for s, name in zip(short, names, strict=True)]


def print_figures(console: Console, results: TrialResults[RobotRecord]) -> None:
    """Every figure of one policy with its interval."""
    table = open_table("figure", ("value", "95 %"))
    intervals = results.aggregate["ci95"]
    for key, value in results.aggregate.items():
        if isinstance(value, (int, float)):
            low_high = intervals.get(key)
            table.add_row(key, f"{value:.4g}", f"{low_high[0]:.3g} to {low_high[1]:.3g}" if low_high else "")
    console.print(table)
    _print_heights(console, {results.policies["locomotion"]["name"]: results})


def print_comparison(console: Console, compared: Mapping[str, TrialResults[RobotRecord]]) -> None:
    """One row for each policy."""
    littered = all(r.config["ground"]["terrain"] == "litter" for r in compared.values())
    columns = _LITTER_COLUMNS if littered else _COLUMNS
    table = open_table("policy", [*[title for _, title, _ in columns], "fell"])
    for name, results in compared.items():
        a, cells = results.aggregate, []
        for key, _, digits in columns:
            value, interval, factor = a.get(key), a["ci95"].get(key), 100 if key.startswith("dirty") else 1
            spread = f" ±{factor * (interval[1] - interval[0]) / 2:.1f}" if interval and key in _SPREAD else ""
            cells.append("-" if value is None else f"{factor * value:.{digits}f}{spread}")
        table.add_row(name, *cells, f"{100 * a['falls']:.1f} %")
    titles = {key: title for key, title, _ in columns}
    print_fitting(console, table, [titles[key] for key in _SPARED if key in titles])
    more = "dirty: foot or leg touched an object" if littered else "trunk over: above blocks, relative to their area"
    console.print(f"errors: RMSE against the command; {more}; fell: robots", soft_wrap=True)
    print_gait(console, {name: results.aggregate for name, results in compared.items()})
    _print_heights(console, compared)


def print_gait(console: Console, figures: Mapping[str, Mapping[str, Any]]) -> None:
    """How the robots walked, one row for each policy: see ``robot_records.aggregate_gait``."""
    table = open_table("gait", [title for _, title, _, _ in _GAIT])
    for name, own in figures.items():
        table.add_row(name, *[format_number(own.get(key), digits, factor) for key, _, factor, digits in _GAIT])
    print_fitting(console, table, ("gap m", "peak", "high %"))
    console.print(_GAIT_WORDS, soft_wrap=True)


def _print_heights(console: Console, compared: Mapping[str, TrialResults[RobotRecord]]) -> None:
    key = "foot_block_per_m_by_height"
    if not any(key in results.aggregate for results in compared.values()):
        return
    titles = [name.replace("-", "-\n") for name in HEIGHT_NAMES]
    table = open_table("policy", ["", *titles], title="steps on blocks per metre, were all blocks so high [m]")
    for name, results in compared.items():
        for limb, title in (("foot", "feet"), ("leg", "legs")):
            row = results.aggregate[f"{limb}_block_per_m_by_height"]
            table.add_row(name, title, *[format_number(row[h]) for h in HEIGHT_NAMES])
    console.print(table)


def print_crossings(console: Console, compared: Mapping[str, CrossingResults]) -> None:
    """One row for each policy and height, in per cent of the crossings with the half-width of the interval, then
    control steps on the bar per crossing."""
    first = next(iter(compared.values())).config
    title = (
        f"{count_things(first['crossings'], 'crossing')} each, bar {first['depth']:g} m deep, {first['speed']:g} m/s: "
        "% of the crossings; control steps on the bar"
    )
    columns = ["cm", *[t for _, t in (*_FRACTIONS, *_MEANS)]]
    table = open_table("policy", columns, title=title, title_justify="left")
    for name, results in compared.items():
        for height, figures in results.aggregate["by_height"].items():
            fractions = [_percent(figures, key) for key, _ in _FRACTIONS]
            means = [f"{figures[key]:.1f}" for key, _ in _MEANS]
            table.add_row(name, f"{100 * float(height):g}", *fractions, *means)
    print_fitting(console, table, ("legs", "feet", "no leg"))
    print_gait(console, {name: results.aggregate for name, results in compared.items()})


def _percent(figures: Mapping[str, Any], key: str) -> str:
    low, high = figures["ci95"][key]
    return f"{100 * figures[key]:.0f} ±{50 * (high - low):.0f}"


def results_as_dict(compared: Mapping[str, TrialResults[Any]], command: Sequence[str], workers: int) -> dict[str, Any]:
    """Results as plain data. One policy alone has its figures in ``aggregate``; of several each has its own in
    ``compared``, and every record of a robot or a crossing names its policy."""
    first = next(iter(compared.values()))
    kind, own = ("crossings", "gains") if isinstance(first.records[0], CrossingRecord) else ("robots", "ground")
    data: dict[str, Any] = {"schema": SCHEMA, "command": list(command), "config": first.config}
    data["environment"] = describe_environment()
    if len(compared) == 1:
        data |= {"policies": first.policies, "aggregate": first.aggregate}
        data[kind] = [round_numbers(asdict(record)) for record in first.records]
    else:
        data["compared"] = {
            name: {"policies": r.policies, own: r.config[own], "aggregate": r.aggregate} for name, r in compared.items()
        }
        data[kind] = [
            {"policy": n, **round_numbers(asdict(record))} for n, r in compared.items() for record in r.records
        ]
    data["timing"] = {"wall_seconds": round(first.wall_seconds, 2), "workers": workers}
    return data


def draw_contacts(compared: Mapping[str, TrialResults[RobotRecord]], path: Path) -> None:
    """Contacts per metre of front and rear feet and legs with their intervals, and of the feet by block height."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10, 4), layout="constrained")
    left, right = figure.subplots(1, 2)
    width = 0.8 / len(compared)
    for k, (name, results) in enumerate(compared.items()):
        a, shift = results.aggregate, (k - (len(compared) - 1) / 2) * width
        heights = np.array([a[key] or 0.0 for key, _ in _BARS])
        bounds = np.array([a["ci95"].get(key) or (h, h) for (key, _), h in zip(_BARS, heights, strict=True)])
        error = np.maximum(np.abs(bounds.T - heights), 0)
        left.bar(np.arange(len(_BARS)) + shift, heights, width, yerr=error, capsize=2, label=name)
        by_height = a.get("foot_block_per_m_by_height", {})
        right.bar(np.arange(len(HEIGHT_NAMES)) + shift, [by_height.get(h) or 0.0 for h in HEIGHT_NAMES], width)
    left.set_xticks(range(len(_BARS)), [title for _, title in _BARS])
    left.set_ylabel("control steps on blocks per metre")
    left.legend(frameon=False)
    right.set_xticks(range(len(HEIGHT_NAMES)), HEIGHT_NAMES)
    right.set_xlabel("height of the block [m]")
    right.set_ylabel("feet on blocks per metre, were all so high")
    for axes in (left, right):
        axes.spines[["top", "right"]].set_visible(False)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=120)


def picture_crossings(compared: Mapping[str, CrossingResults], out: Path) -> None:
    """A film and a drawing for each height, of crossings that were traced."""
    for height in next(iter(compared.values())).config["heights"]:
        traces = {name: results.traces[height] for name, results in compared.items()}
        depth = next(iter(compared.values())).config["depth"]
        name = f"bar_{100 * height:g}cm"
        draw_feet(traces, height, depth, out / f"{name}.png")
        film_crossings({name: some[0] for name, some in traces.items()}, height, depth, out / f"{name}.mp4")
