"""Where the robot can be, and the shortest paths between: eroded floor, connected regions, distance fields.

Distances are those of a 32-neighbour grid: at most 1.4 % longer than the true ones in open space, never shorter than
the straight line.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import gcd

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.ndimage import gaussian_filter1d

from vinl.config.errors import InputError
from vinl.world.floorplan import FloorPlan, measure_clearance
from vinl.world.grid import GridFrame
from vinl.world.raster import label_regions

FOOTPRINT_RADIUS = 0.22
"""Radius that the floor is eroded by [m]: AlienGo's agent radius in the paper's navigator
[paper, IV; habitat-lab, branch vinl]."""

FIT_RADIUS = 0.27
"""Radius for which the robot walks through a gap without touching its sides [m]: half its width over the legs (0.38 m),
and 8 cm for sway and steering at 2 Hz. On a grid of 5 cm a doorway of 0.6 m still counts, one of 0.5 m does not."""


@dataclass(frozen=True, eq=False)
class FreeSpace:
    """The part of a floor plan where the middle of a robot may be whose footprint has a radius [m].

    ``clearance`` is the distance to the nearest wall, furniture or outside [m]; ``traversable`` where it is at least
    the radius; ``regions`` number what is connected, from 1 on, 0 where not traversable. Cells join over edges only, so
    that two regions never touch; ``largest`` is the number of the one with most cells. Raises ``InputError`` if the
    robot fits nowhere.
    """

    plan: FloorPlan
    radius: float = FOOTPRINT_RADIUS
    clearance: Float[np.ndarray, "rows columns"] = field(init=False)
    traversable: Bool[np.ndarray, "rows columns"] = field(init=False)
    regions: Int[np.ndarray, "rows columns"] = field(init=False)
    largest: int = field(init=False)

    def __post_init__(self) -> None:
        clearance = measure_clearance(self.plan.free, self.plan.frame.resolution)
        traversable = clearance >= self.radius
        if not traversable.any():
            raise InputError(
                f"{self.plan.source}: the plan is too small for the robot (radius {self.radius:.2f} m); check its scale"
            )
        regions = label_regions(traversable)
        sizes = np.bincount(regions.ravel())
        sizes[0] = 0
        for name, value in (("clearance", clearance), ("traversable", traversable), ("regions", regions)):
            object.__setattr__(self, name, value)
        object.__setattr__(self, "largest", int(sizes.argmax()))


_STEPS = np.array([(i, j) for i in range(-3, 4) for j in range(-3, 4) if gcd(i, j) == 1 and i * i + j * j <= 13])
_LENGTHS = np.linalg.norm(_STEPS, axis=1)
"""The 32 steps: (1, 0), (1, 1), (1, 2), (1, 3), (2, 3) and their mirror images. They may pass a corner of the eroded
floor by less than two cells; no wall is that thin after erosion."""

SNAP = 0.5
"""A point off the traversable floor is moved to the nearest cell of it, at most this far [m]."""

PATH_SPACING = 0.1
"""Distance between the points of a path [m]."""


def distance_field(
    traversable: Bool[np.ndarray, "rows columns"], frame: GridFrame, goal_xy: Float[np.ndarray, " 2"]
) -> Float[np.ndarray, "rows columns"]:
    """Length of the shortest path to the goal from every cell, float32 [m]; infinite where none leads there. For a goal
    off the traversable floor the nearest cell within ``SNAP`` stands. Raises ``InputError`` if no traversable cell is
    near the goal."""
    goal = _nearest_cell(traversable, frame, goal_xy)
    return (_spread(traversable, goal) * frame.resolution).astype(np.float32)


def read_field(
    field: Float[np.ndarray, "rows columns"], frame: GridFrame, xy: Float[np.ndarray, "*n 2"]
) -> Float[np.ndarray, "*n"]:
    """Distance to the goal [m] at points [m] between the cells' centres: the best of the cells around each point, each
    with the straight line to it added; infinite where no reachable cell is within two cells."""
    xy = np.asarray(xy, dtype=np.float64)
    base = frame.cell(xy)
    best = np.full(xy.shape[:-1], np.inf)
    for di in range(-2, 3):
        for dj in range(-2, 3):
            cell = np.clip(base + np.array([di, dj]), 0, np.array(frame.shape) - 1)
            way = np.linalg.norm(frame.xy(cell) - xy, axis=-1)
            best = np.minimum(best, field[cell[..., 0], cell[..., 1]] + way)
    return np.asarray(best)


def comfortable_path(
    traversable: Bool[np.ndarray, "rows columns"],
    clearance: Float[np.ndarray, "rows columns"],
    frame: GridFrame,
    start_xy: Float[np.ndarray, " 2"],
    goal_xy: Float[np.ndarray, " 2"],
    room: float = 0.5,
) -> Float[np.ndarray, "k 2"]:
    """A path for a robot to follow: short, but through the middle of doors and away from walls where there is space.

    Floor with less clearance than ``room`` [m] costs up to five times its length, the nearer the wall the more. The
    points [m] are at most ``PATH_SPACING`` apart, smoothed over 0.3 m. Raises ``InputError`` if the goal cannot be
    reached from the start.
    """
    start, goal = _nearest_cell(traversable, frame, start_xy), _nearest_cell(traversable, frame, goal_xy)
    cost = 1.0 + 4.0 * np.square(np.clip(1.0 - clearance / room, 0.0, 1.0))
    cheapest = _spread(traversable, goal, cost)
    if not np.isfinite(cheapest[start]):
        raise InputError(f"no path leads from ({start_xy[0]:.2f}, {start_xy[1]:.2f}) to the goal")
    points = _resample(frame.xy(_descend(cheapest, start, cost)), frame.resolution)
    if len(points) > 2:
        smooth = gaussian_filter1d(points, 0.3 / frame.resolution / 2, axis=0, mode="nearest")
        smooth[0], smooth[-1] = points[0], points[-1]
        cells = frame.cell(smooth)
        points = np.where(traversable[cells[:, 0], cells[:, 1], None], smooth, points)
    return _resample(points)


def path_length(path: Float[np.ndarray, "k 2"]) -> float:
    """Length of a line of points [m]."""
    return float(np.linalg.norm(np.diff(path, axis=0), axis=1).sum())


def _spread(mask: np.ndarray, origin: tuple[int, int], cost: np.ndarray | None = None) -> np.ndarray:
    """Cost in cells of the cheapest path from the origin to each cell of the mask; a cell's own cost is at least 1.

    Dijkstra's search, one band of width 1 at a time: no step is cheaper than 1, so a band settles in one go.
    """
    border = 3
    mask = np.pad(mask, border)
    columns = mask.shape[1]
    offsets = _STEPS[:, 0] * columns + _STEPS[:, 1]
    weight = None if cost is None else np.pad(cost, border, constant_values=1.0).ravel()
    best = np.where(mask.ravel(), np.inf, -1.0)
    first = (origin[0] + border) * columns + origin[1] + border
    best[first] = 0.0
    waiting, band = np.array([first]), 0
    while len(waiting):
        band += 1
        settled = best[waiting] < band
        now, waiting = waiting[settled], waiting[~settled]
        to = now[:, None] + offsets
        steps = _LENGTHS if weight is None else _LENGTHS * (weight[now][:, None] + weight[to]) / 2
        total = best[now][:, None] + steps
        better = total < best[to]
        if better.any():
            np.minimum.at(best, to[better], total[better])
            waiting = np.unique(np.concatenate([waiting, to[better]]))
    best[best < 0] = np.inf
    return best.reshape(mask.shape)[border:-border, border:-border]


def _descend(field: np.ndarray, start: tuple[int, int], cost: np.ndarray | None = None) -> np.ndarray:
    """The cells of the cheapest path from the start to where the field (in cells) is zero, shape (k, 2)."""
    cells = [start]
    limit = np.array(field.shape)
    while field[cells[-1]] > 0:
        here = field[cells[-1]]
        near = np.array(cells[-1]) + _STEPS
        held = ((near >= 0) & (near < limit)).all(1)
        near, steps = near[held], _LENGTHS[held]
        if cost is not None:
            steps = steps * (cost[cells[-1]] + cost[near[:, 0], near[:, 1]]) / 2
        values = field[near[:, 0], near[:, 1]]
        best = near[np.where(values < here, values + steps, np.inf).argmin()]
        cells.append((int(best[0]), int(best[1])))
    return np.array(cells)


def _nearest_cell(mask: np.ndarray, frame: GridFrame, xy: Float[np.ndarray, " 2"]) -> tuple[int, int]:
    cell = frame.cell(np.asarray(xy, dtype=np.float64))
    i, j = int(cell[0]), int(cell[1])
    if mask[i, j]:
        return i, j
    reach = int(SNAP / frame.resolution) + 1
    top, left = max(i - reach, 0), max(j - reach, 0)
    window = mask[top : i + reach + 1, left : j + reach + 1]
    if window.any():
        near = np.argwhere(window) + np.array([top, left])
        way = np.linalg.norm(frame.xy(near) - np.asarray(xy), axis=1)
        if way.min() <= SNAP:
            return int(near[way.argmin(), 0]), int(near[way.argmin(), 1])
    raise InputError(f"the point ({xy[0]:.2f}, {xy[1]:.2f}) m is not on floor that the robot can reach")


def _resample(points: np.ndarray, spacing: float = PATH_SPACING) -> np.ndarray:
    """The same line with points at equal distances, at most ``spacing`` apart."""
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    at = np.linspace(0.0, along[-1], int(np.ceil(along[-1] / spacing)) + 1)
    return np.column_stack([np.interp(at, along, points[:, k]) for k in (0, 1)])
