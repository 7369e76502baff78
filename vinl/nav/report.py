"""Figures, table and page of an evaluation of a navigator alone. Takes plain records: names as in ``vinl eval``."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from rich.console import Console

from vinl.chain.metrics import summarise
from vinl.render.drawing import draw_histogram, open_table, outline_boxes, outline_path, print_fitting, render_page
from vinl.robot.aliengo import LENGTH
from vinl.world.boxes import Blocks, Boxes
from vinl.world.endings import END_REASONS, FALL, SUCCESS
from vinl.world.floorplan import BODY_HEIGHT

REASONS = tuple(reason for reason in END_REASONS if reason != FALL)
"""How an episode ends; nothing falls here."""

DISTANCES = (0.0, 5.0, 7.5, 10.0, 15.0, 20.0, 30.0, float("inf"))
"""Edges of the classes of geodesic distance [m]."""

_WORST, _MIDDLE = 6, 3
"""Episodes drawn of every kind of home."""

_NAMED = 3
"""Homes named of every kind: those that most episodes were lost in."""

_FIGURES = ("spl", "soft_spl", "collisions", "distance_m", "time_s")
_MARGIN = 0.4


def aggregate_navigation(records: Sequence[Any]) -> dict[str, Any]:
    """Means with 95 % intervals over episodes: Wilson's for success, by bootstrap otherwise; None without episodes.

    ``collisions`` are cancelled steps of an episode, ``time_s`` is over all episodes.
    """

    def over(get: Callable[[Any], float], fraction: bool = False) -> dict[str, Any]:
        figure = summarise([float(get(r)) for r in records], [r.seed for r in records], fraction)
        return {key: figure[key] for key in ("mean", "ci95")}

    figures: dict[str, Any] = {"success": over(lambda r: r.success, fraction=True)}
    for name in _FIGURES:
        figures[name] = over(lambda r, name=name: getattr(r, name))
    figures["episodes"] = len(records)
    figures["end_reasons"] = {reason: sum(r.end_reason == reason for r in records) for reason in REASONS}
    return figures


def aggregate_by_distance(records: Sequence[Any]) -> list[dict[str, Any]]:
    """The figures of every class of geodesic distance that has episodes; ``to_m`` None: no end."""
    classes = []
    for low, high in pairwise(DISTANCES):
        mine = [r for r in records if low <= r.geodesic_m < high]
        if mine:
            end = high if np.isfinite(high) else None
            classes.append({"from_m": low, "to_m": end, **aggregate_navigation(mine)})
    return classes


def choose_drawn(records: Sequence[Any]) -> tuple[list[int], list[int]]:
    """Which episodes are drawn: the worst, failures first, and those in the middle by SPL."""
    order = sorted(range(len(records)), key=lambda k: (records[k].success, records[k].spl, records[k].soft_spl))
    worst = order[:_WORST]
    rest = order[_WORST:]
    middle = len(rest) // 2
    return worst, rest[max(middle - _MIDDLE // 2, 0) : middle + _MIDDLE // 2 + 1]


def draw_episode(record: Any, trace: Any) -> str:
    """The home with the path through it, as SVG text."""
    solid = Boxes(np.asarray(trace.solid, np.float64))
    corners = solid.corners().reshape(-1, 2)
    low, high = corners.min(0) - _MARGIN, corners.max(0) + _MARGIN
    width, height = high - low
    (sx, sy), (gx, gy) = record.start, record.goal
    ex, ey = trace.path[-1]
    lost = "" if record.success else f'<path class="lost" d="M{ex - 0.15:.2f} {-ey - 0.15:.2f}l.3 .3m0-.3l-.3 .3"/>'
    path = trace.path if len(trace.path) > 1 else np.repeat(trace.path, 2, 0)
    return (
        f'<svg class="map {record.end_reason}" viewBox="{low[0]:.2f} {-high[1]:.2f} {width:.2f} {height:.2f}" '
        f'role="img"><path class="wall" d="{outline_boxes(solid.below(BODY_HEIGHT))}"/>'
        f'<path class="block" d="{outline_boxes(Blocks(np.asarray(trace.blocks, np.float64)).boxes())}"/>'
        f'<path class="walked" d="{outline_path(np.asarray(path))}"/>{lost}'
        f'<circle class="start" cx="{sx:.2f}" cy="{-sy:.2f}" r="{LENGTH / 5:.2f}"/>'
        f'<circle class="goal" cx="{gx:.2f}" cy="{-gy:.2f}" r="{LENGTH / 2:.2f}"/></svg>'
    )


def render_navigation_report(data: dict[str, Any], kinds: Sequence[tuple[Sequence[Any], Sequence[Any]]]) -> str:
    """The page as text.

    Args:
        data: what ``results.json`` holds.
        kinds: records and traces of each kind of home, in the order of ``data["kinds"]``.
    """
    parts = []
    for (name, kind), (records, traces) in zip(data["kinds"].items(), kinds, strict=True):
        worst, middle = choose_drawn(records)
        drawn = [
            {"title": title, "episodes": [(records[k], draw_episode(records[k], traces[k])) for k in chosen]}
            for title, chosen in (("Worst", worst), ("In the middle", middle))
            if chosen
        ]
        parts.append({"name": name, "aggregate": kind["aggregate"], "homes": kind["homes"], "drawn": drawn})
    records = [r for mine, _ in kinds for r in mine]
    histograms = [
        draw_histogram([r.spl for r in records], "SPL", 0.0, 1.0),
        draw_histogram([r.time_s for r in records], "time [s]"),
        draw_histogram([r.collisions for r in records], "collisions in an episode"),
        draw_histogram([r.geodesic_m for r in records], "geodesic distance [m]"),
    ]
    return render_page(
        "nav_report.html.j2",
        {"interval": format_interval},
        data=data,
        parts=parts,
        histograms=histograms,
        command=" ".join(data["command"]),
        environment=data["environment"],
    )


def print_navigation_summary(console: Console, data: dict[str, Any]) -> None:
    """One row for each kind of home, one for all."""
    table = open_table("homes", ("success", "95 %", "SPL", "hits", "s", "stuck", "loops", "n"))
    for name, kind in data["kinds"].items():
        table.add_row(name, *_cells(kind["aggregate"]))
    table.add_section()
    table.add_row("all", *_cells(data["aggregate"]), style="bold")
    print_fitting(console, table, ("s", "hits", "95 %"))


def format_interval(figure: dict[str, Any], digits: int = 3, factor: float = 1.0) -> str:
    """``mean (low to high)``, or a dash."""
    if figure["mean"] is None:
        return "-"
    low, high = figure["ci95"]
    return f"{factor * figure['mean']:.{digits}f} ({factor * low:.{digits}f} to {factor * high:.{digits}f})"


def _cells(figures: dict[str, Any]) -> list[str]:
    if not figures["episodes"]:
        return ["-"] * 7 + ["0"]
    low, high = figures["success"]["ci95"]
    ends = figures["end_reasons"]
    return [
        f"{100 * figures['success']['mean']:.1f} %",
        f"{100 * low:.1f}-{100 * high:.1f}",
        *(f"{figures[key]['mean']:.{digits}f}" for key, digits in (("spl", 3), ("collisions", 1))),
        f"{figures['time_s']['mean']:.1f}",
        *(str(ends.get(reason, 0)) for reason in ("stuck", "looping")),
        str(figures["episodes"]),
    ]


def count_failures(records: Sequence[Any]) -> dict[str, Any]:
    """Of the episodes of one kind: ``lost``, how many by each of the other ``REASONS``, and ``homes`` with their
    losses, the most first."""
    lost = [record for record in records if not record.success]
    homes = Counter(record.plan for record in lost)
    return {
        "episodes": len(records),
        "lost": len(lost),
        "reasons": {reason: sum(r.end_reason == reason for r in lost) for reason in REASONS if reason != SUCCESS},
        "homes": dict(sorted(homes.items(), key=lambda item: (-item[1], item[0]))),
    }


def print_failures(console: Console, kinds: Mapping[str, Mapping[str, Any]]) -> None:
    """A row for each kind of home: episodes lost, how, and where most; nothing if none was lost."""
    if not any(kind["lost"] for kind in kinds.values()):
        return
    reasons = list(next(iter(kinds.values()))["reasons"])
    table = open_table("homes", ("lost", *reasons), title="failures by kind", title_justify="left")
    table.add_column("most in")
    for name, kind in kinds.items():
        worst = ", ".join(f"{home}: {count}" for home, count in list(kind["homes"].items())[:_NAMED])
        table.add_row(name, str(kind["lost"]), *(str(kind["reasons"][reason]) for reason in reasons), worst)
    console.print(table)
