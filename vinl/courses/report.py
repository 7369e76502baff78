"""What a trial of locomotion policies leaves behind: tables in the terminal, results.json, pictures, and films of
robots that step over a bar."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import UInt8
from rich.console import Console

from vinl.config.output import SCHEMA, describe_environment, round_numbers
from vinl.courses.crossing import WIDTH, CrossingRecord, CrossingTrace
from vinl.courses.evaluate import TrialResults
from vinl.courses.evaluate_crossings import CrossingResults
from vinl.courses.robot_records import HEIGHT_NAMES, RobotRecord
from vinl.render.drawing import format_number, open_table
from vinl.render.panels import write_caption, write_film
from vinl.render.raytrace import RayRenderer, look_at
from vinl.render.scene import BLOCK, RobotShape, plain_scene
from vinl.robot.aliengo import CONTROL_DT, FOOT_RADIUS, LEGS, foot_positions
from vinl.world.boxes import Boxes
from vinl.world.grid import GridFrame

SIZE = (640, 320)
"""Width and height of each policy's picture [pixels]."""

SLOWER = 2
"""How much slower than life."""

_FOOT_COLOURS = ("#1f77b4", "#ff7f0e")
_NEAR = 0.85
_GIF_EVERY = 2
_TOUCHED = (0.9, 0.1, 0.1)
_EYE, _AIM, _FIELD = (-1.75, 0.62), 0.22, math.radians(46)
"""The camera stands so far aside and so high [m], high enough that the legs of the far side are seen behind those of
the near one; it looks at the robot at this height [m]."""


def film_crossings(traces: Mapping[str, CrossingTrace], height: float, depth: float, path: Path) -> None:
    """Film one crossing of each policy, one above another, as ``.mp4``, or ``.gif`` with half the pictures; the bar, of
    this height and depth [m], turns red while it is touched."""
    every = _GIF_EVERY if path.suffix == ".gif" else 1
    write_film(draw_frames(traces, height, depth, every), path, round(1 / CONTROL_DT / SLOWER) / every)


def draw_frames(
    traces: Mapping[str, CrossingTrace], height: float, depth: float, every: int = 1
) -> Iterator[UInt8[np.ndarray, "height width 3"]]:
    """The pictures, one for every so many control steps while a robot is near the bar."""
    shape, floor = RobotShape(), GridFrame(-6.0, -6.0, 1.0, (13, 13))
    bar = Boxes(np.array([[0.0, 0.0, np.pi / 2, WIDTH, depth, 0.0, height]]))
    renderers = [
        RayRenderer(plain_scene(bar, [colour], floor, checker=0.25), shape.bodies, shape.names)
        for colour in (BLOCK, _TOUCHED)
    ]
    shown = {name: _near_bar(trace) for name, trace in traces.items()}
    for k in range(0, max(map(len, shown.values())), every):
        rows = []
        for name, steps in shown.items():
            trace, step = traces[name], steps[min(k, len(steps) - 1)]
            touched = trace.feet[step].any() or trace.legs[step].any() or trace.trunk[step]
            pose = trace.qpos[step]
            view = look_at((pose[0] * 0.85, *_EYE), (pose[0] * 0.85, 0.0, _AIM))
            frame = renderers[int(touched)].render(view, *SIZE, *shape.place(pose), hfov=_FIELD)
            feet, legs, trunk = (
                int(flags[: step + 1].reshape(step + 1, -1).any(1).sum())
                for flags in (trace.feet, trace.legs, trace.trunk)
            )
            text = f"{name}, {100 * height:g} cm    steps on the bar: feet {feet}, legs {legs}, trunk {trunk}"
            rows.append(write_caption(frame, text))
        yield np.concatenate(rows)


def _near_bar(trace: CrossingTrace) -> list[int]:
    """Control steps at which the trunk is near the bar."""
    near = np.flatnonzero(np.abs(trace.qpos[:, 0]) < _NEAR)
    return near.tolist() or [len(trace.qpos) - 1]


def draw_feet(traces: Mapping[str, Sequence[CrossingTrace]], height: float, depth: float, path: Path) -> None:
    """Height of the feet along the corridor with a bar of this height and depth [m], front and rear apart, one row of
    panels for each policy.

    A line is the lowest point of a foot: the first crossing strong, the others faint. Red: it touches the bar.
    """
    from matplotlib.figure import Figure
    from matplotlib.patches import Rectangle

    figure = Figure(figsize=(11, 2.6 * len(traces) + 0.4), layout="constrained")
    panels = figure.subplots(len(traces), 2, sharex=True, sharey=True, squeeze=False)
    for row, (name, crossings) in zip(panels, traces.items(), strict=True):
        for axes, pair, title in zip(row, ((0, 1), (2, 3)), ("front feet", "rear feet"), strict=True):
            axes.add_patch(Rectangle((-depth / 2, 0), depth, height, color="0.75"))
            for k, trace in enumerate(crossings):
                feet = foot_positions(np, trace.qpos)
                for foot, colour in zip(pair, _FOOT_COLOURS, strict=True):
                    x, z = feet[:, foot, 0], feet[:, foot, 2] - FOOT_RADIUS
                    strength = {"linewidth": 1.8} if k == 0 else {"linewidth": 0.7, "alpha": 0.35}
                    axes.plot(x, z, color=colour, label=LEGS[foot] if k == 0 else None, **strength)
                    hit = trace.feet[:, foot]
                    axes.plot(x[hit], z[hit], "o", color="red", markersize=3)
            touched = sum(int(trace.feet[:, list(pair)].any(1).sum()) for trace in crossings)
            axes.set_title(f"{name}, {title}: {touched} steps on the bar in {len(crossings)} crossings", fontsize=10)
            axes.legend(frameon=False, loc="upper right")
            axes.spines[["top", "right"]].set_visible(False)
            axes.set_xlim(-0.8, 0.8)
            axes.set_ylim(-0.02, max(0.45, height + 0.2))
        row[0].set_ylabel("lowest point of the foot [m]")
    for axes in panels[-1]:
        axes.set_xlabel("from the middle of the bar [m]")
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=120)


_COLUMNS = (
    ("foot_block_per_m", "feet/m", 2),
    ("foot_front_block_per_m", "front", 2),
    ("foot_rear_block_per_m", "rear", 2),
    ("leg_block_per_m", "legs/m", 2),
    ("linear_velocity_rmse", "m/s", 3),
    ("yaw_rate_rmse", "rad/s", 3),
    ("trunk_over_blocks", "over", 2),
)
"""Figures of the table: name, title, digits."""

_LITTER_COLUMNS = (
    ("dirty_steps", "dirty %", 1),
    ("dirty_foot_steps", "by feet %", 1),
    ("foot_block_per_m", "feet/m", 1),
    ("leg_block_per_m", "legs/m", 1),
    ("linear_velocity_rmse", "m/s", 3),
)
"""The same for litter; fractions of steps in per cent."""

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
    console.print(table)
    over = "" if littered else "; over: trunk above blocks, relative to their area"
    console.print(f"m/s, rad/s: RMSE against the command{over}; fell: robots", soft_wrap=True)
    print_gait(console, {name: results.aggregate for name, results in compared.items()})
    _print_heights(console, compared)


def print_gait(console: Console, figures: Mapping[str, Mapping[str, Any]]) -> None:
    """How the robots walked, one row for each policy: see ``robot_records.aggregate_gait``."""
    table = open_table("gait", [title for _, title, _, _ in _GAIT])
    for name, own in figures.items():
        table.add_row(name, *[format_number(own.get(key), digits, factor) for key, _, factor, digits in _GAIT])
    console.print(table)
    console.print(_GAIT_WORDS, soft_wrap=True)


def _print_heights(console: Console, compared: Mapping[str, TrialResults[RobotRecord]]) -> None:
    key = "foot_block_per_m_by_height"
    if not any(key in results.aggregate for results in compared.values()):
        return
    table = open_table("policy", ["", *HEIGHT_NAMES], title="steps on blocks per metre, were all blocks so high [m]")
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
        f"{first['crossings']} crossings each, bar {first['depth']:g} m deep, {first['speed']:g} m/s: % of the "
        "crossings; control steps on the bar"
    )
    columns = ["cm", *[t for _, t in (*_FRACTIONS, *_MEANS)]]
    table = open_table("policy", columns, title=title, title_justify="left")
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
