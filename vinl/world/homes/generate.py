"""A home from a number: drawn, furnished, its rooms connected; and the sets of homes that are kept for judging."""

from __future__ import annotations

from dataclasses import dataclass
from random import Random

import numpy as np
from jaxtyping import Bool, Float
from scipy.ndimage import distance_transform_edt

from vinl.config.errors import InputError
from vinl.config.limits import check_number
from vinl.config.loader import closest
from vinl.world.boxes import Boxes
from vinl.world.floorplan import (
    BODY_HEIGHT,
    RESOLUTION,
    FloorPlan,
    RoomLabel,
    assemble_floorplan,
    frame_around,
    measure_clearance,
)
from vinl.world.free_space import FIT_RADIUS
from vinl.world.grid import GridFrame
from vinl.world.homes.config import HomeConfig, layout_config
from vinl.world.homes.furnish import Piece, furnish
from vinl.world.homes.gaps import narrow_passages
from vinl.world.homes.rooms import Rect, Room, draw_office, draw_rooms, measure
from vinl.world.homes.walls import Shell, raise_shell
from vinl.world.raster import find_cells, label_regions, paint_boxes

CHECKED_AT = 0.1
"""Side of the cells that paths are checked on [m]. A path that is wide enough on these is wide enough on finer ones."""

CHECKED_RADIUS = 0.349
"""Radius that paths are checked for on the coarse cells [m]. Straight gaps of seven cells pass, so every door does;
between corners, of which the cells may miss the tips, it leaves room for ``free_space.FIT_RADIUS``. Where doors are
narrower than that, paths are checked for ``FIT_RADIUS`` on the plan's own cells."""

POCKET = 0.25
"""Floor cut off from the rest that is let be [m2]: the spot behind an open bedside."""

BETWEEN = 0.6
"""A piece with cells nearer than this to two regions lies between them [m]."""

ROUNDS = 12
"""Pieces are taken away so many times at most; then the home is left bare."""


@dataclass(frozen=True, eq=False)
class Floor:
    """The rooms of a home between its walls, on the cells that paths are checked on.

    Attributes:
        free: what walls leave.
        windows, owners: the cells of each rectangle of a room, and the number of its room.
        radius: that paths are checked for [m].
    """

    free: Bool[np.ndarray, "rows columns"]
    frame: GridFrame
    windows: list[tuple[slice, slice]]
    owners: list[int]
    radius: float

    def find_reached(self, free: Bool[np.ndarray, "rows columns"]) -> tuple[np.ndarray, np.ndarray, int, set[int]]:
        """The regions that a robot can walk in, their sizes [cells], the largest of them (0: none), and the rooms in
        it."""
        regions = label_regions(measure_clearance(free, self.frame.resolution) >= self.radius)
        sizes = np.bincount(regions.ravel())
        sizes[0] = 0
        main = int(sizes.argmax())
        windows = zip(self.owners, self.windows, strict=True)
        return regions, sizes, main, {k for k, where in windows if main and (regions[where] == main).any()}


def lay_floor(rooms: list[Room], walls: Boxes, name: str, config: HomeConfig) -> Floor:
    """The floor of a home without furniture."""
    rects = [rect for room in rooms for rect in room.rects]
    cell, radius = (RESOLUTION, FIT_RADIUS) if config.has_narrow_doors else (CHECKED_AT, CHECKED_RADIUS)
    frame = frame_around(*_bound(rects), name, cell)
    free = paint_rects(rects, frame) & ~paint_boxes(walls.below(BODY_HEIGHT), frame)
    owners = [k for k, room in enumerate(rooms) for _ in room.rects]
    return Floor(free, frame, [_window(rect, frame) for rect in rects], owners, radius)


def keep_connected(floor: Floor, pieces: list[Piece]) -> list[Piece] | None:
    """The pieces that may stay, so that a robot of ``FIT_RADIUS`` reaches every room, and all floor but pockets; None
    if the rooms are not connected even without furniture."""
    cells, windows, owners = _find_low(pieces, floor.frame), floor.windows, floor.owners
    rooms, kept = set(owners), set(range(len(pieces)))
    for attempt in range(ROUNDS + 1):
        free = floor.free.copy()
        for k in kept:
            free.flat[cells[k]] = False
        regions, sizes, main, reached = floor.find_reached(free)
        if not main:
            return None
        lost = rooms - reached
        bad = {int(k) for k in np.flatnonzero(sizes * floor.frame.resolution**2 >= POCKET)} - {main}
        gone: set[int] = set()
        for room in lost:
            inner = [k for k in kept if pieces[k].room == room]
            parts = [regions[where] for owner, where in zip(owners, windows, strict=True) if owner == room]
            islands = {int(k) for part in parts for k in np.unique(part[part > 0])}
            bad |= islands
            if attempt >= ROUNDS // 2 or not islands:
                gone |= set(inner) if attempt >= ROUNDS // 2 else set(inner[-1:])
        if bad:
            gone |= _blame(regions, main, bad, cells, kept, pieces, BETWEEN / floor.frame.resolution)
        if not gone:
            return None if lost else [pieces[k] for k in sorted(kept)]
        kept -= gone
    return [] if floor.find_reached(floor.free)[3] == rooms else None


def add_gaps(rng: Random, floor: Floor, pieces: list[Piece], density: float) -> list[Piece]:
    """What narrows passages, ``density`` for each 100 m2; all that a robot reaches without it is reached with it."""
    free, cell = floor.free.copy(), floor.frame.resolution**2
    for cells in _find_low(pieces, floor.frame):
        free.flat[cells] = False

    def measure_reach(left: Bool[np.ndarray, "rows columns"]) -> tuple[set[int], int]:
        _, sizes, main, reached = floor.find_reached(left)
        return reached, int((np.delete(sizes, main) * cell >= POCKET).sum())

    before = measure_reach(free)
    count = int(density * free.sum() * cell / 100 + rng.random())
    rows = narrow_passages(rng, free, floor.frame, count, floor.radius, lambda left: measure_reach(left) == before)
    return [Piece(0, [row]) for row in rows]


def paint_rects(rects: list[Rect], frame: GridFrame) -> Bool[np.ndarray, "rows columns"]:
    """The cells whose centre lies in one of the rectangles."""
    grid = np.zeros(frame.shape, dtype=bool)
    for rect in rects:
        grid[_window(rect, frame)] = True
    return grid


def _bound(rects: list[Rect]) -> tuple[Float[np.ndarray, "2"], Float[np.ndarray, "2"]]:
    """The lowest and the highest corner of all [m]."""
    corners = np.array(rects)
    return corners[:, :2].min(0), corners[:, 2:].max(0)


def _window(rect: Rect, frame: GridFrame) -> tuple[slice, slice]:
    """The cells whose centre lies in a rectangle."""
    x0, y0, x1, y1 = rect
    low = np.ceil((np.array([y0, x0]) - [frame.y0, frame.x0]) / frame.resolution - 1e-9).astype(int)
    high = np.floor((np.array([y1, x1]) - [frame.y0, frame.x0]) / frame.resolution + 1e-9).astype(int) + 1
    return slice(max(low[0], 0), max(high[0], 0)), slice(max(low[1], 0), max(high[1], 0))


def _find_low(pieces: list[Piece], frame: GridFrame) -> list[np.ndarray]:
    """For each piece the numbers of the cells under those of its parts that take floor from the robot."""
    rows = [(k, row) for k, piece in enumerate(pieces) for row in piece.rows if row[5] < BODY_HEIGHT]
    numbers = np.arange(frame.shape[0] * frame.shape[1]).reshape(frame.shape)
    parts: list[list[np.ndarray]] = [[np.zeros(0, int)] for _ in pieces]
    boxes = Boxes(np.array([row for _, row in rows]).reshape(-1, 7))
    for (k, _), (where, along, held) in zip(rows, find_cells(boxes, frame), strict=True):
        under = numbers[where, along]
        parts[k].append(under.ravel() if held is True else under[held])
    return [np.concatenate(part) for part in parts]


def _blame(
    regions: np.ndarray, main: int, bad: set[int], cells: list, kept: set[int], pieces: list[Piece], reach: float
) -> set[int]:
    """For each region that is cut off, the piece to take away: one that lies between it and others, ``reach`` cells
    from both at most."""
    steps, (rows, columns) = distance_transform_edt(regions == 0, return_indices=True)  # type: ignore[misc]
    nearest = np.where(steps < reach, regions[rows, columns], 0)
    beside = {k: set(nearest.flat[cells[k]].tolist()) - {0} for k in kept}
    gone: set[int] = set()
    for region in bad:
        near = [k for k in kept if region in beside[k]]
        between = [k for k in near if main in beside[k]] or [k for k in near if len(beside[k]) > 1] or near
        if between and not gone & set(between):
            # chairs go before tables, small things before large ones
            gone.add(min(between, key=lambda k: (pieces[k].chief, len(cells[k]), k)))
    return gone


ATTEMPTS = 100
"""Layouts drawn for a home before the ranges are taken for impossible; one to three are the rule."""

IMPOSSIBLE = "homes: no home fits the config; widen its ranges (area, corridor_width, door_width)"


def generate_home(seed: int, config: HomeConfig | None = None, resolution: float = RESOLUTION) -> FloorPlan:
    """Generate a home: rooms, walls, doors, furniture. The same seed, 0 or more, gives the same home.

    Every room can be reached by a robot of radius ``free_space.FIT_RADIUS``; furniture that would prevent it is left
    away. Walls and furniture do not depend on ``resolution``, the side of the cells of the plan's grids, 0.02 to 0.1
    [m].

    Raises:
        InputError: if the seed is negative, the resolution out of range, or no home fits the config.
    """
    config = config or HomeConfig()
    check_number("homes: the seed", seed)
    check_number("homes: the resolution [m]", resolution, 0.02, CHECKED_AT)
    rng = Random(seed)
    name = f"home-{seed}"
    for _ in range(ATTEMPTS):
        shell = draw_shell(rng, config)
        walls = Boxes(np.array(shell.walls))
        floor = lay_floor(shell.rooms, walls, name, config)
        pieces = keep_connected(floor, furnish(rng, shell, config))
        if pieces is None:
            continue
        if config.gaps:
            pieces += add_gaps(rng, floor, pieces, config.gaps)
        rects = [rect for room in shell.rooms for rect in room.rects]
        frame = frame_around(*_bound(rects), name, resolution)
        inside = paint_rects(rects, frame)
        furniture = Boxes(np.array([row for piece in pieces for row in piece.rows]).reshape(-1, 7))
        panes = Boxes(np.array(shell.panes).reshape(-1, 7))
        middles = [(room.kind, max(room.rects, key=measure)) for room in shell.rooms]
        labels = tuple(RoomLabel(kind, (x0 + x1) / 2, (y0 + y1) / 2) for kind, (x0, y0, x1, y1) in middles)
        return assemble_floorplan(name, f"generated:{seed}", walls, furniture, inside, frame, panes, labels, roomy=True)
    raise InputError(IMPOSSIBLE)


def draw_shell(rng: Random, config: HomeConfig) -> Shell:
    """Rooms, walls and doors. Raises ``InputError`` if no home fits the config."""
    for _ in range(ATTEMPTS):
        rooms = draw_office(rng, config) if config.layout == "office" else draw_rooms(rng, config)
        if not config.area[0] <= sum(room.area for room in rooms) <= config.area[1]:
            continue
        shell = raise_shell(rng, rooms, config)
        if shell is not None:
            return shell
    raise InputError(IMPOSSIBLE)


RESERVED_FROM = 1_000_000_000
"""Seeds from here on are for judging; trainings keep below."""


@dataclass(frozen=True)
class JudgingSet:
    """So many floors of one of ``LAYOUTS``, as ``layout_config`` has it, from a row of seeds."""

    layout: str
    first_seed: int
    count: int = 20

    def generate(self) -> list[FloorPlan]:
        """The floors, the same on every machine."""
        config = layout_config(self.layout)
        return [generate_home(seed, config) for seed in range(self.first_seed, self.first_seed + self.count)]


JUDGING_SETS = {
    "offices": JudgingSet("office", 2_000_000_000),
    "dead_ends": JudgingSet("dead_ends", 2_100_000_000),
    "narrow": JudgingSet("narrow", 2_200_000_000),
}
"""20 office floors, 20 homes whose rooms and doors make a tree, and 20 with thick walls, narrow doors and gaps that a
robot does not fit through."""


def find_judging_set(name: str) -> JudgingSet:
    """The set of a name. Raises ``InputError`` if there is none."""
    if name not in JUDGING_SETS:
        raise InputError(
            f"unknown set of homes {name!r}{closest(name, JUDGING_SETS)}; known: {', '.join(JUDGING_SETS)}"
        )
    return JUDGING_SETS[name]
