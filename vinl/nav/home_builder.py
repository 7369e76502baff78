"""A floor plan becomes what the navigation environment needs of it: distance fields, clearance, starts, triangles.

Runs in worker processes; imports no torch.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from jaxtyping import Float, Int, UInt8

from vinl.config.errors import InputError
from vinl.nav.config import ClutterConfig, NavConfig
from vinl.nav.fields import spread_fields
from vinl.world.boxes import Blocks, Boxes
from vinl.world.floorplan import RESOLUTION, FloorPlan, measure_clearance
from vinl.world.grid import GridFrame
from vinl.world.homes.config import layout_config
from vinl.world.mesh import seen_box_mesh
from vinl.world.raster import find_largest, label_regions

FINE = 2
"""Cells of the clearance grid along a side of a cell of the distance fields."""

FIELD_RESOLUTION = FINE * RESOLUTION
"""Side of a cell of the distance fields [m]."""

REACH = 0.625
"""Clearance is known up to this [m]; more than half the robot's diagonal."""

FRINGE = 0.12
"""The distance to the goal is also known where the robot's middle is off the paths, but this far from walls [m]."""

_OVER_CAMERA = 0.6
"""No motion lifts the camera by so much [m]."""

_LEAST_PAIRS = 0.01
"""At least this fraction of start and goal pairs must lie within the range of distances."""


@dataclass(frozen=True, eq=False)
class HomeRecord:
    """What the host remembers of a home.

    Attributes:
        floor: its free cells, eight in a byte.
        solid: (n, 7) boxes of walls and furniture.
        blocks: (m, 6) rows of the clutter.
    """

    seed: int
    name: str
    frame: GridFrame
    floor: UInt8[np.ndarray, " bytes"]
    solid: Float[np.ndarray, "n 7"]
    blocks: Float[np.ndarray, "m 6"]

    def restore_plan(self) -> FloorPlan:
        """The floor plan, as far as paths on it are concerned: furniture counts as wall."""
        rows, columns = self.frame.shape
        free = np.unpackbits(self.floor, count=rows * columns).astype(bool).reshape(rows, columns)
        return FloorPlan(self.name, self.name, Boxes(self.solid.astype(float)), Boxes.empty(), free, free, self.frame)


@dataclass(frozen=True, eq=False)
class BuiltHome(HomeRecord):
    """One home, ready to be put on the device.

    Attributes:
        origin: of the grids: x and y of the centre of cell [0, 0] [m].
        fields: (rows, columns, goals) distance to each goal [m], infinite where it cannot be reached from.
        clearance: (2 rows, 2 columns) distance to the nearest wall or furniture, up to ``REACH`` [m]; cell [2 r, 2 c]
            has the centre of cell [r, c] of the fields.
        goals: (goals, 2) [m].
        starts: (starts, 2) spots where episodes may begin [m].
        vertices, faces: walls, furniture and blocks; no floor, no ceiling.
    """

    origin: tuple[float, float]
    fields: Float[np.ndarray, "rows columns goals"]
    clearance: Float[np.ndarray, "fine_rows fine_columns"]
    goals: Float[np.ndarray, "goals 2"]
    starts: Float[np.ndarray, "starts 2"]
    vertices: Float[np.ndarray, "v 3"]
    faces: Int[np.ndarray, "f 3"]

    @property
    def cells(self) -> int:
        """Cells of one distance field."""
        return self.fields.shape[0] * self.fields.shape[1]


def build_home(seed: int, config: NavConfig) -> BuiltHome | str:
    """The home of a seed: generated, or one of the configured floor plans.

    Returns:
        The home, or why there is none: its floor plan has no start and goal as far apart as asked for.
    """
    rng = np.random.default_rng([seed, 40493])
    homes = config.homes
    if homes.plans_share > 0 and rng.random() < homes.plans_share:
        paths = _expand(homes.plans)
        return build_plan(paths[rng.integers(len(paths))], seed, config)
    from vinl.world.homes import generate_home

    generator = homes.generator
    if homes.layouts:
        drawn, layouts = rng.random(), list(homes.layouts)
        at = int(np.searchsorted(np.cumsum(list(homes.layouts.values())), drawn, side="right"))
        generator = layout_config(layouts[at], generator) if at < len(layouts) else generator
    try:
        plan = generate_home(seed, generator)
    except InputError as error:
        return str(error)
    return prepare_home(plan, seed, config)


def build_plan(path: str, seed: int, config: NavConfig) -> BuiltHome | str:
    """The home of a floor plan's file (one plan, not a range); the seed is that of goals, starts and clutter.

    Returns:
        The home, or why there is none: its file, or its floor, cannot be used.
    """
    try:
        plan = _load_plan(path)
    except InputError as error:
        return str(error)
    return prepare_home(plan, seed, config)


@lru_cache(maxsize=256)
def _load_plan(path: str) -> FloorPlan:
    from vinl.world.readers import load_floorplan  # pictures need libraries that generated homes do without

    return load_floorplan(path)


@lru_cache(maxsize=4)
def _expand(paths: tuple[str, ...]) -> list[str]:
    from vinl.world.readers import expand_paths

    return expand_paths(paths)


def prepare_home(plan: FloorPlan, seed: int, config: NavConfig) -> BuiltHome | str:
    """Distance fields, clearance, starts and triangles of a floor plan.

    Args:
        plan: the floor plan, on a grid of 5 cm.

    Returns:
        The home, or why it cannot be used.

    Raises:
        InputError: if the plan has another grid than one of 5 cm.
    """
    if abs(plan.frame.resolution - RESOLUTION) > 1e-9:
        raise InputError(f"{plan.source}: needs a grid of {RESOLUTION:g} m, got {plan.frame.resolution:g} m")
    rng = np.random.default_rng([seed, 68279])
    homes = config.homes
    fine = np.minimum(measure_clearance(plan.free, RESOLUTION), REACH).astype(np.float16)
    region = find_largest(label_regions(fine[::FINE, ::FINE] >= homes.path_radius))
    if not region.any():
        return f"{plan.name}: the robot fits nowhere"
    fine, region, first = _crop(fine, region)
    coarse = fine[::FINE, ::FINE]
    goal_spots = np.argwhere(region & (coarse >= homes.goal_clearance))
    start_spots = np.argwhere(region & (coarse >= homes.start_clearance))
    if not len(goal_spots) or not len(start_spots):
        return f"{plan.name}: no spot has the clearance of {max(homes.goal_clearance, homes.start_clearance):.2f} m"
    goals = goal_spots[rng.integers(len(goal_spots), size=homes.goals)]
    starts = start_spots[rng.integers(len(start_spots), size=homes.starts)]
    mask = np.where(region, 2, np.where(coarse >= FRINGE, 1, 0)).astype(np.uint8)
    fields = spread_fields(mask, goals, FIELD_RESOLUTION)
    low, high = config.episodes.distance
    reach = fields[starts[:, 0], starts[:, 1]]
    if ((reach >= low) & (reach <= high)).mean() < _LEAST_PAIRS:
        return f"{plan.name}: hardly any path is {low:g} m to {high:g} m long"
    boxes = plan.boxes
    if not len(boxes):
        return f"{plan.name}: there are no walls"
    blocks = _draw_blocks(plan, rng, config.clutter)
    highest = (0.0 if config.camera is None else config.camera.mount_height) + _OVER_CAMERA
    vertices, faces = seen_box_mesh(boxes + blocks.boxes(), highest)
    x0, y0 = plan.frame.xy(first)
    to_xy = np.array([x0, y0])
    return BuiltHome(
        seed=seed,
        name=plan.name,
        frame=plan.frame,
        floor=np.packbits(plan.free),
        solid=boxes.rows.astype(np.float32),
        blocks=blocks.rows.astype(np.float32),
        origin=(float(x0), float(y0)),
        fields=fields,
        clearance=np.ascontiguousarray(fine),
        goals=(to_xy + goals[:, ::-1] * FIELD_RESOLUTION).astype(np.float32),
        starts=(to_xy + starts[:, ::-1] * FIELD_RESOLUTION).astype(np.float32),
        vertices=vertices,
        faces=faces,
    )


def _crop(fine: np.ndarray, region: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Both grids cut to the region and a margin as wide as the robot; the first cell of the fine one."""
    margin = round(0.5 / FIELD_RESOLUTION)
    rows, columns = np.flatnonzero(region.any(1)), np.flatnonzero(region.any(0))
    low = np.maximum([rows[0] - margin, columns[0] - margin], 0)
    high = np.array([rows[-1] + margin + 1, columns[-1] + margin + 1])
    high = np.minimum(high, np.array(fine.shape) // FINE)
    inner = region[low[0] : high[0], low[1] : high[1]]
    return fine[low[0] * FINE : high[0] * FINE, low[1] * FINE : high[1] * FINE], inner, low * FINE


def _draw_blocks(plan: FloorPlan, rng: np.random.Generator, clutter: ClutterConfig) -> Blocks:
    """Blocks on the free floor, for the camera to see; kept apart, but not out of the way of starts and goals."""
    if rng.random() >= clutter.share:
        return Blocks.empty()
    spots = np.argwhere(plan.free)
    wanted = round(rng.uniform(*clutter.density) * len(spots) * plan.frame.resolution**2)
    tried = plan.frame.xy(spots[rng.integers(len(spots), size=2 * wanted)])
    apart = ((tried[:, None] - tried) ** 2).sum(-1) >= clutter.spacing**2
    allowed, kept = np.ones(len(tried), bool), []
    for k in range(len(tried)):
        if allowed[k] and len(kept) < wanted:
            kept.append(k)
            allowed &= apart[k]
    placed, n = tried[kept], len(kept)
    length, height = rng.uniform(*clutter.length, n), rng.uniform(*clutter.height, n)
    yaw = rng.uniform(-np.pi, np.pi, n)
    return Blocks(np.column_stack([placed, yaw, length, np.full(n, clutter.width), height]))
