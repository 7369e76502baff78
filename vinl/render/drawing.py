"""Drawings of the report as SVG text: maps in metres, histograms in pixels. Colours are left to the page's style."""

from __future__ import annotations

import base64
import io
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from jaxtyping import Bool, Float
from PIL import Image
from rich import box
from rich.console import Console
from rich.table import Table

from vinl.chain.records import Episode, EpisodeTrace
from vinl.chain.robot import KINDS
from vinl.robot.aliengo import LENGTH
from vinl.world.boxes import Blocks, Boxes
from vinl.world.floorplan import BODY_HEIGHT, FloorPlan

CONTACT_CLASS = dict(zip(KINDS, ("fb", "fw", "lb", "lw", "tb", "tw"), strict=True))
"""Style class of each kind of contact."""

POINT_DT = 0.2
"""Time between two points of a way on the map [s]."""

_MARGIN = 0.4
_GRAIN = 0.02

_WIDE = 40.0
"""Maps up to this width [m] share one length of the scale bar, so that homes are compared at a glance."""


def outline_boxes(boxes: Boxes) -> str:
    """Path data of the footprints [m], y up turned to y down."""
    if not len(boxes):
        return ""
    return "".join("M" + "L".join(f"{x:.2f} {-y:.2f}" for x, y in corners) + "Z" for corners in boxes.corners())


def outline_path(path: Float[np.ndarray, "k 2"]) -> str:
    """Path data of a path [m]: every second point, ``POINT_DT`` apart, and where it ended; to the centimetre."""
    return "M" + "L".join(f"{x:.2f} {-y:.2f}" for x, y in np.vstack([path[::2], path[-1]]))


def mark_contacts(trace: EpisodeTrace) -> list[tuple[str, str, str]]:
    """Style class, path data and times of every kind of contact.

    A dot at each place, places 2 cm apart told apart; for each the time of its first contact in tenths of a second.
    """
    marks = []
    for kind, name in enumerate(KINDS):
        at = trace.contacts[trace.contacts[:, 1] == kind, 2:]
        if len(at):
            places, first = np.unique(np.rint(at / _GRAIN), axis=0, return_index=True)
            times = 10 * trace.contacts[trace.contacts[:, 1] == kind, 0][first]
            dots = "".join(f"M{x:.2f} {-y:.2f}h0" for x, y in places * _GRAIN)
            marks.append((CONTACT_CLASS[name], dots, " ".join(f"{time:.0f}" for time in times)))
    return marks


def draw_floor(inside: Bool[np.ndarray, "rows columns"]) -> str:
    """The inside of the building as a small picture with a transparent outside, as a data address."""
    alpha = (inside[::-1] * 255).astype(np.uint8)
    return encode_picture(Image.fromarray(np.stack([np.full_like(alpha, 128), (alpha * 0.13).astype(np.uint8)], -1)))


def encode_picture(picture: Image.Image) -> str:
    """A picture as a data address."""
    file = io.BytesIO()
    picture.save(file, "PNG", optimize=True)
    return "data:image/png;base64," + base64.b64encode(file.getvalue()).decode()


def draw_map(plan: FloorPlan, episodes: Sequence[Episode], first: int, radius: float) -> str:
    """A floor plan with all paths of its episodes through it. ``first`` is the number of the first one on the page,
    ``radius`` that of the goals [m]."""
    cells = np.argwhere(plan.inside)
    low, high = plan.frame.xy(cells.min(0)) - _MARGIN, plan.frame.xy(cells.max(0)) + _MARGIN
    x, y = plan.frame.centres()
    half = plan.frame.resolution / 2
    width, height = high - low
    parts = [
        f'<svg class="map" viewBox="{low[0]:.2f} {-high[1]:.2f} {width:.2f} {height + 0.45:.2f}" role="img" '
        f'style="--w:{width / height:.3f}">',
        f'<image href="{draw_floor(plan.inside)}" x="{x[0] - half:.3f}" y="{-y[-1] - half:.3f}" '
        f'width="{x[-1] - x[0] + 2 * half:.3f}" height="{y[-1] - y[0] + 2 * half:.3f}" preserveAspectRatio="none"/>',
        f'<path class="furniture" d="{outline_boxes(plan.furniture.below(BODY_HEIGHT))}"/>',
        f'<path class="wall" d="{outline_boxes(plan.walls.below(BODY_HEIGHT))}"/>',
    ]
    for k, episode in enumerate(episodes):
        record, trace = episode.record, episode.trace
        marks = "".join(
            f'<path class="touch {name}" d="{data}" data-times="{times}"/>'
            for name, data, times in mark_contacts(trace)
        )
        ex, ey = trace.path[-1]
        lost = "" if record.success else f'<path class="lost" d="{_cross(ex, ey)}"/>'
        parts.append(
            f'<g class="ep {record.end_reason}" id="e{first + k}" data-end="{record.time_s:.2f}"><path class="block" '
            f'd="{outline_boxes(Blocks(trace.blocks).boxes())}"/><path class="walked" d="{outline_path(trace.path)}"/>'
            f"{marks}{lost}<title>episode {record.episode}, seed {record.seed}: {record.end_reason}, "
            f"{record.distance_m:.1f} m in {record.time_s:.0f} s</title></g>"
        )
    for record in {e.record.episode: e.record for e in episodes}.values():
        (sx, sy), (gx, gy) = record.start, record.goal
        parts.append(
            f'<g class="route" data-episode="{record.episode}"><circle class="start" cx="{sx:.2f}" cy="{-sy:.2f}" '
            f'r="{LENGTH / 5:.2f}"/><circle class="goal" cx="{gx:.2f}" cy="{-gy:.2f}" r="{radius:.2f}"/>'
            f'<text x="{gx:.2f}" y="{-gy + 0.11:.2f}">{record.episode}</text></g>'
        )
    bar = 2 if width <= _WIDE else 10
    bx, by = low[0] + 0.4, -low[1] + 0.15
    parts.append(
        f'<g class="scale"><path d="M{bx:.2f} {by:.2f}h{bar}"/>'
        f'<text x="{bx + bar + 0.1:.2f}" y="{by + 0.1:.2f}">{bar} m</text></g></svg>'
    )
    return "".join(parts)


def draw_histogram(values: Sequence[float], title: str, low: float = 0.0, high: float | None = None) -> str:
    """A histogram of 20 bars with its mean; its range goes up to the largest value by default."""
    v = np.asarray([x for x in values if np.isfinite(x)], dtype=np.float64)
    top = high if high is not None else _nice(float(v.max()) if len(v) else 1.0)
    counts, _ = np.histogram(np.clip(v, low, top), bins=20, range=(low, top))
    peak = max(int(counts.max()), 1)
    w, h, base = 300, 150, 118
    bars = "".join(
        f'<rect x="{14 + k * 13.6:.1f}" y="{base - tall:.1f}" width="12.2" height="{tall:.1f}" rx="1.5"/>'
        for k, c in enumerate(counts)
        if (tall := 84 * c / peak)
    )
    mean = ""
    if len(v):
        x = 14 + 272 * (min(max(float(v.mean()), low), top) - low) / (top - low)
        side, shift = ("end", -4) if x > 200 else ("start", 4)
        mean = (
            f'<path class="mean" d="M{x:.1f} 22V{base}"/>'
            f'<text class="mean" x="{x + shift:.1f}" y="30" text-anchor="{side}">mean {v.mean():.3g}</text>'
        )
    ticks = "".join(
        f'<text class="tick" x="{14 + 272 * f:.0f}" y="134" text-anchor="{a}">{low + f * (top - low):.3g}</text>'
        for f, a in ((0.0, "start"), (0.5, "middle"), (1.0, "end"))
    )
    return (
        f'<svg class="histogram" viewBox="0 0 {w} {h}" role="img"><title>{title}</title>'
        f'<text class="title" x="14" y="12">{title}</text>{bars}'
        f'<path class="axis" d="M14 {base}H286"/>{mean}{ticks}</svg>'
    )


def _cross(x: float, y: float, size: float = 0.12) -> str:
    return f"M{x - size:.2f} {-y - size:.2f}l{2 * size} {2 * size}m0 {-2 * size}l{-2 * size} {2 * size}"


def _nice(value: float) -> float:
    """The next round number."""
    if value <= 0:
        return 1.0
    power = 10.0 ** np.floor(np.log10(value))
    return float(next(m for m in (1, 1.5, 2, 3, 4, 5, 6, 8, 10) if m * power >= value * 0.9999) * power)


def render_page(template: str, filters: Mapping[str, Callable[..., Any]], **values: Any) -> str:
    """A page of ``vinl/render/templates`` as text. Raises ``ModuleNotFoundError`` if jinja2 is not there."""
    import jinja2  # figures without a page can be had without it

    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("vinl.render"), autoescape=True, undefined=jinja2.StrictUndefined
    )
    environment.filters |= {"number": format_number, **filters}
    return environment.get_template(template).render(**values)


def open_table(first: str, columns: Iterable[str], **options: Any) -> Table:
    """A table for the terminal: names on the left, then columns of numbers."""
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, collapse_padding=True, **options)
    table.add_column(first, overflow="fold", min_width=9)
    for title in columns:
        table.add_column(title, justify="right", no_wrap=True)
    return table


def print_fitting(console: Console, table: Table, spared: Iterable[str]) -> None:
    """Print a table of ``open_table``. In a narrow terminal, columns titled as in ``spared`` are left out, the first
    ones first, until names and the other figures stand there whole."""
    for title in spared:
        if console.measure(table, options=console.options.update(width=1000)).maximum <= console.width:
            break
        kept = [column for column in table.columns if column.header != title]
        # rich pads the last column by its number: one that keeps its old one is measured too narrow and cut
        table.columns = [replace(column, _index=k) for k, column in enumerate(kept)]
    console.print(table)


def format_number(value: float | None, digits: int = 2, factor: float = 1.0, sign: str = "", unit: str = "") -> str:
    """A number times a factor, or a dash where there is none."""
    return "-" if value is None else f"{factor * value:{sign}.{digits}f}{unit}"
