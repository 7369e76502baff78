"""Training grounds: tiles of rising difficulty on one shared height field."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from jaxtyping import Float
from scipy import ndimage

from vinl.config.errors import InputError
from vinl.config.limits import check_fields
from vinl.world.boxes import Blocks, Boxes
from vinl.world.floorplan import RESOLUTION
from vinl.world.grid import BLOCK, WALL, GridFrame, HeightField, flat_field, raise_boxes

_PITCH = (0.7, 1.4)
"""Distances from ring to ring [m]: a robot 0.65 m long can just stand between two, or stride over one at a time."""

_TILT = np.pi / 12
"""A tile's rings are turned by up to so much [rad]; farther, and their corners would reach into other tiles."""


def draw_hurdles(
    rng: np.random.Generator, side: float, clear: float, height: tuple[float, float], depth: float = 0.2
) -> Blocks:
    """Square rings around the origin, each of four blocks of one height, without a gap at the corners.

    None reaches beyond the tile, whose side is given [m], or into the square of half-width ``clear`` in its middle [m],
    so that a small tile has none. ``height`` is the range of the rings' heights [m], ``depth`` theirs [m] [paper IV-A:
    0.2].
    """
    tilt = rng.uniform(-_TILT, _TILT)
    rows = []
    for at in _places(rng, side, clear * np.sqrt(2), tilt, depth):
        high = rng.uniform(*height)
        rows += [
            [at * np.cos(turn), at * np.sin(turn), turn + np.pi / 2, 2 * at + depth, depth, high]
            for turn in tilt + np.arange(4) * np.pi / 2
        ]
    return Blocks(np.array(rows).reshape(-1, 6))


def draw_bars(
    rng: np.random.Generator, side: float, clear: float, height: tuple[float, float], depth: float = 0.2
) -> Blocks:
    """Parallel bars on both sides of the origin, each as long as the tile is wide; arguments as for ``draw_hurdles``.

    A robot that walks along them meets none; one that keeps its way across crosses each.
    """
    tilt = rng.uniform(-_TILT, _TILT)
    half = side / 2 / (np.cos(tilt) + np.sin(abs(tilt)))
    across = tilt + rng.integers(2) * np.pi / 2
    rows = [
        [sign * at * np.cos(across), sign * at * np.sin(across), across + np.pi / 2, 2 * half, depth,
         rng.uniform(*height)]
        for sign in (1, -1)
        for at in _places(rng, side, clear * np.sqrt(2), tilt, depth)
    ]  # fmt: skip
    return Blocks(np.array(rows).reshape(-1, 6))


def _places(rng: np.random.Generator, side: float, clear: float, tilt: float, depth: float) -> list[float]:
    """Distances of the middles of rings or bars from the origin [m], turned by ``tilt`` and kept to the tile, off a
    circle of radius ``clear`` [m]."""
    farthest = side / 2 / (np.cos(tilt) + np.sin(abs(tilt))) - depth / 2
    at, places = clear + depth / 2 + rng.uniform(0, _PITCH[0]), []
    while at <= farthest:
        places.append(at)
        at += rng.uniform(*_PITCH)
    return places


_WIDE, _TIGHT = (1.6, 2.6), (1.0, 1.8)
"""Distances of the walls of an easy and of a hard tile [m]."""

_START_SIDE = (1.4, 2.0)
"""Sides of the room in the middle [m]: a robot that starts within 0.3 m of its middle can turn on the spot there."""

_DOOR, _THICK = (0.75, 1.1), (0.08, 0.2)
"""Widths of doorways and of walls [m], as in homes."""

_OPEN, _CLOSED = 0.25, 0.4
"""Shares of the walls between two rooms that are missing, so that rooms become corridors, and that have no doorway, so
that there are corners; the room in the middle always has a way out."""

_SHORTEST = 0.1
"""Walls shorter than this are left out [m]."""


def draw_rooms(rng: np.random.Generator, side: float, difficulty: float) -> Boxes:
    """Walls of a tile of this side [m] around the origin, one metre high: missing, with a doorway, or closed, and the
    nearer to each other the higher the difficulty, 0 to 1."""
    xs, ys = _stand_walls(rng, side, difficulty), _stand_walls(rng, side, difficulty)
    rows: list[list[float]] = []
    for turned, lines, across in ((False, ys, xs), (True, xs, ys)):
        for at in lines:
            for a, b in pairwise(across):
                # ahead of a robot that looks along x
                exit_ = bool(turned and at == xs[xs > 0].min() and a < 0 < b)
                yaw = np.pi / 2 if turned else 0.0
                for start, end in _piece_wall(rng, a, b, exit_):
                    middle = [(start + end) / 2, at][:: -1 if turned else 1]
                    rows.append([*middle, yaw, end - start, rng.uniform(*_THICK), 0.0, 1.0])
    return Boxes(np.array(rows).reshape(-1, 7))


def _stand_walls(rng: np.random.Generator, side: float, difficulty: float) -> Float[np.ndarray, " k"]:
    """Where walls stand along an axis [m]: around the middle room, then on to both sides."""
    low, high = ((1 - difficulty) * w + difficulty * t for w, t in zip(_WIDE, _TIGHT, strict=True))
    half = rng.uniform(*_START_SIDE) / 2
    ends = []
    for _ in range(2):
        at = [half]
        while True:
            further = at[-1] + rng.uniform(low, high)
            if further >= side / 2:
                break
            at.append(further)
        ends.append(np.array(at))
    return np.concatenate([-ends[0][::-1], ends[1]])


def _piece_wall(rng: np.random.Generator, a: float, b: float, passable: bool) -> list[tuple[float, float]]:
    """The pieces of a wall between two others: none, one on each side of a doorway, or all of it."""
    drawn = rng.random()
    if drawn < _OPEN:
        return []
    if drawn > 1 - _CLOSED and not passable:
        return [(a, b)]
    door = min(rng.uniform(*_DOOR), b - a)
    start = rng.uniform(a, b - door)
    return [(p, q) for p, q in ((a, start), (start + door, b)) if q - p > _SHORTEST]


TILE = 8.0
"""Side of a tile [m] [ViNL config]."""

_START = np.zeros((1, 2))
"""Robots start around the middle of a tile."""

BORDER = 8.0
"""Level ground around all tiles [m]."""

CELLS = round(TILE / RESOLUTION)


@dataclass(frozen=True)
class TerrainConfig:
    """Which tiles lie where. Levels run along x, columns along y; every column holds one type.

    Attributes:
        slope, rough_slope, stairs_up, stairs_down, discrete, walls, blocks, rooms, hurdles, bars: fractions of the
            columns. ``hurdles`` are closed rings, ``bars`` reach from side to side: nobody walks around either.
        levels: rows of rising difficulty; difficulty of level k is k / levels, 0 to 0.9 for ten [ViNL code].
        columns: columns of tiles.
        seed: of everything random in the tiles.
        block_density: blocks per m2 on the last level of a ``blocks`` tile; the first level has none.
        block_height: range of the blocks' heights [m] [paper IV-A: 0.1-0.2].
        tall_density: furniture-like tall boxes per m2 on ``blocks`` and ``walls`` tiles beyond the first level.
        start_clear: half-width of the square around the start without blocks [m].
        wall_blocks: blocks on ``walls`` and ``rooms`` tiles, as a fraction of those on ``blocks`` tiles.
        first_height: range of the blocks' heights up to the middle level [m], from which they grow evenly to
            ``block_height`` on the last; None: ``block_height`` on all levels.
        depth: of rings and bars, and of blocks up to 0.2 m, on the first level and from the middle one on [m]; between
            them it grows evenly. Depth comes before height: with random steps a foot comes down clear of a bar 5 cm
            deep in half of the crossings, of one 0.2 m deep in an eighth.
        ghost: fraction of the training in which blocks are on the map and judged, but nothing to collide with.
    """

    slope: float = 0.10
    rough_slope: float = 0.10
    stairs_up: float = 0.35
    stairs_down: float = 0.25
    discrete: float = 0.20
    walls: float = 0.0
    blocks: float = 0.0
    rooms: float = 0.0
    hurdles: float = 0.0
    bars: float = 0.0
    levels: int = 10
    columns: int = 20
    seed: int = 0
    block_density: float = 1.5
    block_height: tuple[float, float] = (0.1, 0.2)
    tall_density: float = 0.03
    start_clear: float = 0.8
    wall_blocks: float = 0.0
    first_height: tuple[float, float] | None = None
    depth: tuple[float, float] = (0.2, 0.2)
    ghost: float = 0.0

    def __post_init__(self) -> None:
        heights, densities = ("block_height", "first_height", "depth"), ("block_density", "tall_density")
        check_fields(
            self,
            "terrain.",
            counts=("levels", "columns"),
            rising=heights,
            positive=heights,
            unsigned=(*densities, "start_clear"),
            fractions=("wall_blocks", "ghost"),
        )
        fractions = self.fractions()
        if min(fractions.values()) < 0 or abs(sum(fractions.values()) - 1) > 1e-6:
            raise InputError(
                f"terrain: the fractions of the tile types must add up to 1, got {sum(fractions.values()):.3f}"
            )

    def fractions(self) -> dict[str, float]:
        """Fraction of every tile type, in the order of the columns."""
        flat = ("slope", "rough_slope", "stairs_up", "stairs_down", "discrete")
        return {name: getattr(self, name) for name in (*flat, "walls", "blocks", "rooms", "hurdles", "bars")}

    def heights_at(self, level: int) -> tuple[float, float]:
        """Range of the blocks' heights on a level [m]."""
        if self.first_height is None:
            return self.block_height
        part = max(2 * level / max(self.levels - 1, 1) - 1, 0.0)
        low, high = (a + part * (b - a) for a, b in zip(self.first_height, self.block_height, strict=True))
        return low, high

    def depth_at(self, level: int) -> float:
        """Depth of rings and bars on a level [m]."""
        part = min(2 * level / max(self.levels - 1, 1), 1.0)
        return self.depth[0] + part * (self.depth[1] - self.depth[0])

    def column_kinds(self) -> list[str]:
        """The tile type of every column."""
        edges = np.cumsum(list(self.fractions().values()))
        middle = (np.arange(self.columns) + 0.5) / self.columns
        return [list(self.fractions())[k] for k in np.searchsorted(edges, middle)]


@dataclass(frozen=True, eq=False)
class Terrain:
    """Tiles on one height field, whose centre is the world's origin, with the blocks and the tall boxes of all of them.

    ``starts`` are the middles of the tiles, x, y and the highest ground within 0.8 m [m]; ``kinds`` the tile type of
    every column.
    """

    ground: HeightField
    starts: Float[np.ndarray, "levels columns 3"]
    kinds: list[str]
    blocks: Blocks = field(default_factory=Blocks.empty)
    tall: Boxes = field(default_factory=Boxes.empty)


def _radius() -> Float[np.ndarray, "cells cells"]:
    """Distance of every vertex of a tile from its middle, by the larger coordinate [m]."""
    g = np.abs((np.arange(CELLS) + 0.5) * RESOLUTION - TILE / 2)
    return np.maximum(g[:, None], g[None])


def slope_tile(difficulty: float, up: bool) -> Float[np.ndarray, "cells cells"]:
    """A pyramid with slope 0.4 x difficulty and a platform 3 m wide [legged_gym]."""
    return (1 if up else -1) * 0.4 * difficulty * (TILE / 2 - np.maximum(_radius(), 1.5))


def rough_slope_tile(difficulty: float, up: bool, rng: np.random.Generator) -> Float[np.ndarray, "cells cells"]:
    """The pyramid with noise of +-0.05 m, drawn every 0.2 m and interpolated [legged_gym]."""
    n = CELLS // 4 + 1
    coarse = rng.integers(-10, 11, (n, n)) * 0.005
    return slope_tile(difficulty, up) + ndimage.zoom(coarse, CELLS / n, order=1)[:CELLS, :CELLS]


def stairs_tile(difficulty: float, up: bool) -> Float[np.ndarray, "cells cells"]:
    """Nine steps of 0.3 m around a platform, 0.05 + 0.18 x difficulty high [legged_gym]. ``up``: start on top."""
    step = np.clip(np.ceil((_radius() - 1.3) / 0.3 - 1e-9), 0, 9)
    return (1 if up else -1) * (9 - step) * (0.05 + 0.18 * difficulty)


def discrete_tile(difficulty: float, rng: np.random.Generator) -> Float[np.ndarray, "cells cells"]:
    """Twenty slabs and pits with sides of 1, 1.4 or 1.8 m and heights up to 0.05 + 0.2 x difficulty [legged_gym]."""
    heights, h = np.zeros((CELLS, CELLS)), 0.05 + 0.2 * difficulty
    for _ in range(20):
        w, d = rng.choice([20, 28, 36], 2)
        i, j = rng.integers(0, (CELLS - w) // 8 + 1) * 8, rng.integers(0, (CELLS - d) // 8 + 1) * 8
        heights[i : i + w, j : j + d] = rng.choice([h, -h, h / 2, -h / 2])
    heights[_radius() < 1.5] = 0.0
    return heights


def scatter_centres(
    rng: np.random.Generator, count: int, half: float, clear: float, spacing: float, taken: Float[np.ndarray, "k 2"]
) -> Float[np.ndarray, "n 2"]:
    """Random points in the square |x|, |y| <= half, off the square < clear, no two nearer than the spacing [m]."""
    kept = list(taken)
    for _ in range(20 * count):
        if len(kept) == count + len(taken):
            break
        p = rng.uniform(-half, half, 2)
        if np.abs(p).max() < clear:
            continue
        if not kept or np.min(np.linalg.norm(np.array(kept) - p, axis=1)) > spacing:
            kept.append(p)
    return np.array(kept[len(taken) :]).reshape(-1, 2)


def draw_blocks(
    rng: np.random.Generator, centres: Float[np.ndarray, "n 2"], height: tuple[float, float], depth: float = 0.2
) -> Blocks:
    """Blocks of 0.2-0.5 x 0.2 m, or of another depth, with any yaw on the given points [paper IV-A]."""
    n = len(centres)
    return Blocks(
        np.column_stack(
            [centres, rng.uniform(0, np.pi, n), rng.uniform(0.2, 0.5, n), np.full(n, depth), rng.uniform(*height, n)]
        )
    )


def draw_tall(rng: np.random.Generator, centres: Float[np.ndarray, "n 2"], long: bool) -> Boxes:
    """Furniture-like boxes, or walls up to 3 m long, one metre high, with any yaw."""
    n = len(centres)
    length = rng.uniform(1.0, 3.0, n) if long else rng.uniform(0.4, 1.0, n)
    width = rng.uniform(0.1, 0.3, n) if long else rng.uniform(0.2, 0.4, n)
    return Boxes(np.column_stack([centres, rng.uniform(0, np.pi, n), length, width, np.zeros(n), np.ones(n)]))


def build_terrain(config: TerrainConfig) -> Terrain:
    """Draw all tiles."""
    border = round(BORDER / RESOLUTION)
    shape = (config.columns * CELLS + 2 * border + 1, config.levels * CELLS + 2 * border + 1)
    frame = GridFrame(-(shape[1] - 1) * RESOLUTION / 2, -(shape[0] - 1) * RESOLUTION / 2, RESOLUTION, shape)
    ground, kinds = flat_field(frame), config.column_kinds()
    starts = np.zeros((config.levels, config.columns, 3))
    blocks, tall = [], []
    for c, kind in enumerate(kinds):
        up = kinds[:c].count(kind) % 2 == 0
        for k in range(config.levels):
            rng = np.random.default_rng([config.seed, c, k])
            difficulty = k / config.levels
            i, j = border + c * CELLS, border + k * CELLS
            middle = frame.xy(np.array([i, j])) + TILE / 2
            shift = np.array([*middle, 0, 0, 0, 0, 0])
            starts[k, c, :2] = middle
            tile, none = ground.heights[i : i + CELLS, j : j + CELLS], np.zeros((0, 2))
            match kind:
                case "slope":
                    tile[:] = slope_tile(difficulty, up)
                case "rough_slope":
                    tile[:] = rough_slope_tile(difficulty, up, rng)
                case "stairs_up" | "stairs_down":
                    tile[:] = stairs_tile(difficulty, up=kind == "stairs_down")
                case "discrete":
                    tile[:] = discrete_tile(difficulty, rng)
                case "hurdles" | "bars":
                    if k > 0:
                        draw = draw_hurdles if kind == "hurdles" else draw_bars
                        drawn = draw(rng, TILE, config.start_clear, config.heights_at(k), config.depth_at(k)).rows
                        blocks.append(Blocks(drawn + shift[:6]))
                case "rooms":
                    tall.append(Boxes(draw_rooms(rng, TILE, difficulty).rows + shift))
                    blocks.append(_tile_blocks(config, rng, k, middle, none, config.wall_blocks))
                case "walls":
                    count = round(difficulty * 0.15 * TILE**2)
                    here = scatter_centres(rng, count, TILE / 2 - 0.3, 1.0, 1.2, none)
                    boxes = [draw_tall(rng, here[::2], long=True), draw_tall(rng, here[1::2], long=False)]
                    # a wall is long: those nearer than 1.3 m to the middle, where robots start, are left out
                    far = [b.rows[b.distances(_START)[:, 0] > 1.3] for b in boxes]
                    tall += [Boxes(rows + shift) for rows in far]
                    blocks.append(_tile_blocks(config, rng, k, middle, here, config.wall_blocks))
                case _:
                    here = scatter_centres(rng, round(config.tall_density * TILE**2) if k else 0, 3.7, 1.5, 1.5, none)
                    tall.append(Boxes(draw_tall(rng, here, long=False).rows + shift))
                    blocks.append(_tile_blocks(config, rng, k, middle, here))
    all_blocks, all_tall = sum(blocks, Blocks.empty()), sum(tall, Boxes.empty())
    raise_boxes(ground, all_blocks.boxes(), BLOCK)
    raise_boxes(ground, all_tall, WALL)
    near = round(0.8 / RESOLUTION)
    cells = frame.cell(starts[..., :2])
    for k, c in np.ndindex(config.levels, config.columns):
        i, j = cells[k, c]
        here = slice(i - near, i + near + 1), slice(j - near, j + near + 1)
        starts[k, c, 2] = ground.heights[here][ground.labels[here] != WALL].max()
    return Terrain(ground, starts, kinds, all_blocks, all_tall)


def _tile_blocks(
    config: TerrainConfig,
    rng: np.random.Generator,
    level: int,
    middle: Float[np.ndarray, "2"],
    taken: Float[np.ndarray, "k 2"],
    fraction: float = 1.0,
) -> Blocks:
    """The blocks of a tile: none on the first level, a ``fraction`` of all on the last, none at the start."""
    wanted = fraction * config.block_density * TILE**2 * level / max(config.levels - 1, 1)
    clear = config.start_clear + 0.3  # half a block's diagonal more
    centres = scatter_centres(rng, round(wanted), TILE / 2, clear, 0.45, taken)
    blocks = draw_blocks(rng, centres, config.heights_at(level), min(config.depth_at(level), 0.2))
    return Blocks(blocks.rows + np.array([*middle, 0, 0, 0, 0]))
