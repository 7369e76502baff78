"""Training grounds: tiles of rising difficulty on one shared height field."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float
from scipy import ndimage

from vinl.config.errors import InputError
from vinl.config.limits import check_fields
from vinl.world.blocks import Blocks
from vinl.world.boxes import Boxes
from vinl.world.floorplan import RESOLUTION
from vinl.world.grid import GridFrame
from vinl.world.heightfield import BLOCK, WALL, HeightField, flat_field, raise_boxes
from vinl.world.tiles import draw_bars, draw_hurdles, draw_rooms

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
    """Tiles on one height field.

    Attributes:
        ground: heights and labels; its centre is the world's origin.
        starts: (levels, columns, 3) middle of every tile: x, y and the highest ground within 0.8 m [m].
        kinds: tile type of every column.
        blocks: the blocks of all tiles.
        tall: the tall boxes of all tiles.
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
    """Draw all tiles.

    Returns:
        The terrain: tile [level k, column c] has its middle at ``starts[k, c]``.
    """
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
            tiles: dict[str, Callable[[], np.ndarray]] = {
                "slope": lambda d=difficulty, up=up: slope_tile(d, up),
                "rough_slope": lambda d=difficulty, up=up, rng=rng: rough_slope_tile(d, up, rng),
                "stairs_up": lambda d=difficulty: stairs_tile(d, up=False),
                "stairs_down": lambda d=difficulty: stairs_tile(d, up=True),
                "discrete": lambda d=difficulty, rng=rng: discrete_tile(d, rng),
            }
            if kind in tiles:
                ground.heights[i : i + CELLS, j : j + CELLS] = tiles[kind]()
                continue
            none = np.zeros((0, 2))
            if kind in ("hurdles", "bars"):
                if k > 0:
                    draw = draw_hurdles if kind == "hurdles" else draw_bars
                    drawn = draw(rng, TILE, config.start_clear, config.heights_at(k), config.depth_at(k)).rows
                    blocks.append(Blocks(drawn + shift[:6]))
            elif kind == "rooms":
                tall.append(Boxes(draw_rooms(rng, TILE, difficulty).rows + shift))
                if config.wall_blocks > 0:
                    blocks.append(_tile_blocks(config, rng, k, middle, none, config.wall_blocks))
            elif kind == "walls":
                count = round(difficulty * 0.15 * TILE**2)
                here = scatter_centres(rng, count, TILE / 2 - 0.3, 1.0, 1.2, none)
                boxes = [draw_tall(rng, here[::2], long=True), draw_tall(rng, here[1::2], long=False)]
                # a wall is long: those that would reach into the start are left out
                tall += [Boxes(b.rows + shift) for b in map(_off_the_start, boxes)]
                if config.wall_blocks > 0:
                    blocks.append(_tile_blocks(config, rng, k, middle, here, config.wall_blocks))
            else:
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


def _off_the_start(boxes: Boxes) -> Boxes:
    """The boxes of a tile that a robot can start beside: they leave a disc of 1.3 m around its middle free."""
    return Boxes(boxes.rows[boxes.distances(_START)[:, 0] > 1.3])
