"""Walls between rooms and around them, doors that join all rooms, and panes in the outer walls."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from itertools import pairwise
from random import Random

from vinl.world.homes.config import HomeConfig
from vinl.world.homes.rooms import Rect, Room

EASE = {"hall": 0.0, "living": 1.0, "studio": 0.5, "kitchen": 2.0, "dining": 2.0}
PRIVATE = {"bath": 7.0, "wc": 7.0, "store": 7.0}
"""How unlikely a door is, by the rooms on both sides; 4 for the rooms not named: one enters a bath from the corridor,
not from another bath."""

KEPT_CLEAR = 0.8
"""Floor on both sides of a door that furniture keeps off [m]."""

Row = tuple[float, float, float, float, float, float, float]
"""One box, as in ``Boxes.rows``."""


@dataclass
class Edge:
    """A stretch of line where two rectangles touch, or one and the outside.

    Attributes:
        upright: whether the line runs along y.
        at: where the line lies across [m].
        low, high: where it begins and ends along [m].
        rooms: number of the room on the side of smaller coordinates, then of larger; -1 is outside.
        gaps: (low, high, top) of its openings [m].
    """

    upright: bool
    at: float
    low: float
    high: float
    rooms: tuple[int, int]
    gaps: list[tuple[float, float, float]] = field(default_factory=list)


@dataclass
class Shell:
    """A home without furniture. Edges are where walls stand (lines within one room have none), walls include lintels,
    panes are windows and the front door, drawn only; ``inner`` and ``outer`` are thicknesses [m]. ``clear`` has for
    each room rectangles before its doors."""

    rooms: list[Room]
    edges: list[Edge]
    walls: list[Row]
    panes: list[Row]
    inner: float
    outer: float
    height: float
    clear: list[list[Rect]]


def raise_shell(rng: Random, rooms: list[Room], config: HomeConfig) -> Shell | None:
    """Walls and doors for rooms; ``None`` if some room cannot be given a door."""
    inner = round(rng.uniform(*config.inner_wall), 3)
    outer = round(max(inner, rng.uniform(*config.outer_wall)), 3)
    edges = _find_edges(rooms)
    clear: list[list[Rect]] = [[] for _ in rooms]
    if not _cut_doors(rng, rooms, edges, config, outer, clear):
        return None
    height = round(rng.uniform(*config.wall_height), 2)
    panes = _cut_panes(rng, rooms, edges, outer, clear)
    return Shell(rooms, edges, _raise(edges, inner, outer, height), panes, inner, outer, height, clear)


def _find_edges(rooms: list[Room]) -> list[Edge]:
    rects = [(*rect, k) for k, room in enumerate(rooms) for rect in room.rects]
    edges = []
    for upright in (True, False):
        a, b, c, d = (0, 1, 2, 3) if upright else (1, 0, 3, 2)
        ends: dict[float, list] = {}
        starts: dict[float, list] = {}
        for rect in rects:
            ends.setdefault(rect[c], []).append((rect[b], rect[d], rect[4]))
            starts.setdefault(rect[a], []).append((rect[b], rect[d], rect[4]))
        for at in sorted(set(ends) | set(starts)):
            before, after = ends.get(at, []), starts.get(at, [])
            stops = sorted({stop for stretch in before + after for stop in stretch[:2]})
            line: list[Edge] = []
            for low, high in pairwise(stops):
                middle = (low + high) / 2
                left = next((k for lo, hi, k in before if lo < middle < hi), -1)
                right = next((k for lo, hi, k in after if lo < middle < hi), -1)
                if left == right:
                    continue
                if line and line[-1].rooms == (left, right) and line[-1].high == low:
                    line[-1].high = high
                else:
                    line.append(Edge(upright, at, low, high, (left, right)))
            edges += line
    return edges


def _cut_doors(
    rng: Random, rooms: list[Room], edges: list[Edge], config: HomeConfig, outer: float, clear: list[list[Rect]]
) -> bool:
    """Open the cheapest edges that join all rooms, and some more; of a home with dead ends any edges, and no more."""
    ease = [EASE.get(room.kind, PRIVATE.get(room.kind, 4.0)) for room in rooms]
    margin = outer / 2 + 0.06
    tree = config.layout == "dead_ends"
    found = []
    for edge in edges:
        i, j = edge.rooms
        if min(i, j) >= 0 and edge.high - edge.low - 2 * margin >= config.door_width[0]:
            use = 0.0 if tree else ease[i] + ease[j]
            found.append((use + rng.uniform(0.0, 1.5), len(found), edge))
    group = list(range(len(rooms)))
    left = len(rooms) - 1
    for cost, _, edge in sorted(found):
        i, j = edge.rooms
        if group[i] != group[j]:
            old, new = group[i], group[j]
            group = [new if g == old else g for g in group]
            left -= 1
        elif tree or cost > 6.5 or rng.random() > config.loop_share:
            continue
        _cut_door(rng, edge, config, margin, not tree and ease[i] <= 2.0 and ease[j] <= 2.0, clear)
    return left == 0


def _cut_door(
    rng: Random, edge: Edge, config: HomeConfig, margin: float, public: bool, clear: list[list[Rect]]
) -> None:
    room = edge.high - edge.low - 2 * margin
    width, top = rng.uniform(*config.door_width), rng.uniform(*config.door_height)
    if public and room > 1.4 and rng.random() < config.passage_share:
        width = rng.uniform(1.3, 2.4)
        top = 99.0 if rng.random() < 0.5 else top  # without a lintel
    width = round(min(width, room), 3)
    spare = room - width
    # most doors stand near a corner
    share = rng.random() if rng.random() < 0.4 else rng.choice((0.0, 1.0, rng.uniform(0.0, 0.15)))
    low = round(edge.low + margin + spare * share, 3)
    edge.gaps.append((low, round(low + width, 3), round(top, 2)))
    for room_index, side in zip(edge.rooms, (-1, 1), strict=True):
        clear[room_index].append(_clear_before(edge, low - 0.05, low + width + 0.05, side))


def _clear_before(edge: Edge, low: float, high: float, side: int) -> Rect:
    near, far = sorted((edge.at, edge.at + side * (KEPT_CLEAR + 0.1)))
    return (near, low, far, high) if edge.upright else (low, near, high, far)


def _cut_panes(rng: Random, rooms: list[Room], edges: list[Edge], outer: float, clear: list[list[Rect]]) -> list[Row]:
    """Windows in the outer walls, and one front door, in the corridor if that reaches the outside."""
    panes: list[Row] = []
    rank = {"hall": 0, "studio": 1, "living": 2, "kitchen": 3}
    outside = [edge for edge in edges if min(edge.rooms) < 0 and edge.high - edge.low >= 1.0 + outer]
    if not outside:
        return panes
    front = min(outside, key=lambda edge: (rank.get(rooms[max(edge.rooms)].kind, 9), rng.random()))
    for edge in outside:
        room, side = max(edge.rooms), 1 if edge.rooms[0] < 0 else -1
        length = edge.high - edge.low - outer
        if edge is front:
            middle = rng.uniform(edge.low + outer / 2 + 0.5, edge.high - outer / 2 - 0.5)
            panes.append(_pane(edge, middle, 0.9, 0.0, 2.05))
            clear[room].append(_clear_before(edge, middle - 0.5, middle + 0.5, side))
            continue
        if rooms[room].kind in ("store", "wc") or rng.random() < 0.15:
            continue
        for k in range(n := max(1, int(length / 3.5))):
            wide = min(rng.uniform(0.8, 2.0), length / n - 0.3)
            if wide > 0.4:
                panes.append(_pane(edge, edge.low + outer / 2 + length * (k + 0.5) / n, wide, 0.9, 2.1))
    return panes


def _pane(edge: Edge, middle: float, width: float, bottom: float, top: float) -> Row:
    x, y, yaw = (edge.at, middle, math.pi / 2) if edge.upright else (middle, edge.at, 0.0)
    return (round(x, 3), round(y, 3), yaw, round(width, 3), 0.08, bottom, top)


def _raise(edges: list[Edge], inner: float, outer: float, height: float) -> list[Row]:
    """Boxes: what is left of each line beside its gaps, and the lintels. Lines go on over rooms of the same kind of
    wall, and a little beyond their ends, to fill the corners."""
    lines: dict[tuple[bool, float, bool], list[list]] = {}
    for edge in edges:
        line = lines.setdefault((edge.upright, edge.at, min(edge.rooms) < 0), [])
        if line and line[-1][1] == edge.low:
            line[-1][1] = edge.high
            line[-1][2] += edge.gaps
        else:
            line.append([edge.low, edge.high, list(edge.gaps)])
    rows: list[Row] = []

    def add(upright: bool, at: float, low: float, high: float, thick: float, bottom: float) -> None:
        # always turned by nothing or by a quarter: as length along x or as length along y
        middle, long = round((low + high) / 2, 4), round(high - low, 4)
        if upright:
            rows.append((at, middle, 0.0, thick, long, bottom, height))
        else:
            rows.append((middle, at, 0.0, long, thick, bottom, height))

    for (upright, at, is_outer), stretches in lines.items():
        thick = outer if is_outer else inner
        for low, high, gaps in stretches:
            start = low - thick / 2
            for a, b, top in sorted(gaps):
                add(upright, at, start, a, thick, 0.0)
                if height - top > 0.05:
                    add(upright, at, a, b, thick, top)
                start = b
            add(upright, at, start, high + thick / 2, thick, 0.0)
    return rows
