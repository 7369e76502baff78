"""The grounds that a locomotor is tried on: level floor, the stage-1 terrains, blocks, litter, small rooms."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import mujoco
import numpy as np
from jaxtyping import Bool, Float, Int
from scipy import ndimage

from vinl.chain.scene import build_scene
from vinl.config.errors import InputError
from vinl.sensing.depth import Mesh
from vinl.world.boxes import Blocks, Boxes
from vinl.world.clutter import draw_litter
from vinl.world.grid import BLOCK, GridFrame, HeightField, flat_field, raise_boxes
from vinl.world.mesh import box_mesh, floor_mesh, heightfield_mesh, join_meshes
from vinl.world.terrain import TILE, TerrainConfig, build_terrain, draw_blocks, scatter_centres

TERRAINS = ("flat", "rough", "blocks", "litter", "rooms")

FIELD, LITTER_FIELD = 12.0, 8.0
"""Half the side of the square that blocks, that litter covers [m]."""

DENSITY = {"litter": 10.0}
"""Objects per m2 if nothing is asked for; 1 on other terrains."""

_DENSEST = {"litter": 30.0}

UNSEEN = 7919
"""Added to the seed of the terrain, so that it is not the one of the training."""

_ROOM_COLUMNS = 8
"""Tiles of rooms on each level."""

_ROOM_SPREAD = 0.3
"""Half-width of the square that robots start in, in the middle room of a tile [m]: as in training."""

_RESOLUTION, _LITTER_RESOLUTION = 0.05, 0.025
_HORIZON = GridFrame(-1000.0, -1000.0, 10.0, (201, 201))


@dataclass(frozen=True)
class GroundConfig:
    """Which ground.

    Attributes:
        terrain: ``flat``, ``rough`` (the five types of stage 1), ``blocks``, ``litter`` (small objects, see
            ``world.clutter``) or ``rooms`` (walls close by, and blocks).
        density: blocks or objects per m2, for ``blocks``, ``litter`` and, on level 9 of them and fewer below, for
            ``rooms``; 0 is no block under the same rules.
        level: level of all robots, for ``rough`` and ``rooms``; spread evenly over levels 1 to 9 if None.
        seed: of the terrain.
        kp, kd: gains of the joints.
    """

    terrain: str
    density: float
    level: int | None
    seed: int
    kp: float
    kd: float

    def __post_init__(self) -> None:
        if self.terrain not in TERRAINS:
            raise InputError(f"--terrain {self.terrain!r} is unknown; known: {', '.join(TERRAINS)}")
        densest = _DENSEST.get(self.terrain, 4.0)
        if not 0 <= self.density <= densest:
            raise InputError(
                f"--density must lie between 0 and {densest:g} per m2 on {self.terrain} ground, got {self.density:g}"
            )
        if self.level is not None and not 0 <= self.level <= 9:
            raise InputError(f"--level must lie between 0 and 9, got {self.level}")
        if self.level is not None and self.terrain not in ("rough", "rooms"):
            raise InputError(f"--level is for --terrain rough and rooms, not for {self.terrain}")


@dataclass(frozen=True, eq=False)
class Ground:
    """A compiled world for robots that do not see each other, with the field that maps and cameras see, its blocks,
    which starts keep clear of, and walls.

    ``homes`` are where robots start: x, y and ground height [m], each with its terrain type and level, -1 where there
    are none. A robot is put back that is farther from home than ``reach`` along x or y [m]; it starts in the square
    around it of half-width ``spread`` [m], with the whole trunk off the blocks, or ``among`` them, no foot on one.
    """

    model: mujoco.MjModel
    field: HeightField
    homes: Float[np.ndarray, "h 3"]
    levels: Int[np.ndarray, " h"]
    kinds: list[str]
    reach: float
    spread: float
    blocks: Blocks
    walls: Boxes
    among: bool = False

    @cached_property
    def _block_distance(self) -> Float[np.ndarray, "rows columns"]:
        free = self.field.labels != BLOCK
        return np.asarray(ndimage.distance_transform_edt(free)) * self.field.frame.resolution

    def gap(self, xy: Float[np.ndarray, "*n 2"]) -> Float[np.ndarray, "*n"]:
        """From points to the nearest cell of a block [m]."""
        row, column = np.moveaxis(self.field.frame.cell(xy), -1, 0)
        return self._block_distance[row, column]

    def on_block(self, xy: Float[np.ndarray, "*n 2"]) -> Bool[np.ndarray, "*n"]:
        """Whether points [m] lie on a block, to half a cell of 5 cm."""
        row, column = np.moveaxis(self.field.frame.cell(xy), -1, 0)
        return self.field.labels[row, column] == BLOCK

    def covered(self) -> float | None:
        """Fraction of the ground within reach that blocks cover; None without blocks."""
        if not len(self.blocks):
            return None
        x, y = self.field.frame.centres()
        squares = [np.ix_(np.abs(y - home[1]) < self.reach, np.abs(x - home[0]) < self.reach) for home in self.homes]
        return float(np.mean([(self.field.labels[square] == BLOCK).mean() for square in squares]))

    def mesh(self) -> Mesh:
        """What a camera sees: blocks and walls as boxes on a plane, or the height field."""
        boxes = self.blocks.boxes() + self.walls
        if self.field.heights.any() and not len(boxes):
            return heightfield_mesh(self.field.heights, self.field.frame)
        return join_meshes(box_mesh(boxes), floor_mesh(_HORIZON))


def build_ground(config: GroundConfig) -> Ground:
    """Draw the ground and compile it."""
    if config.terrain in ("rough", "rooms"):
        return _build_tiles(config)
    among = config.terrain == "litter"
    half, r = (LITTER_FIELD, _LITTER_RESOLUTION) if among else (FIELD, _RESOLUTION)
    cells = round(2 * (half + 2) / r) + 1
    field = flat_field(GridFrame(-(half + 2), -(half + 2), r, (cells, cells)))
    rng = np.random.Generator(np.random.Philox(np.random.SeedSequence([config.seed, UNSEEN])))
    blocks = Blocks.empty()
    if among:
        blocks = draw_litter(rng, config.density, half)
    elif config.terrain == "blocks" and config.density > 0:
        spacing = 0.75 if config.density <= 1 else 0.75 / config.density**0.5
        count = round(config.density * (2 * half) ** 2)
        blocks = draw_blocks(rng, scatter_centres(rng, count, half, 0.0, spacing, np.zeros((0, 2))), (0.1, 0.2))
    raise_boxes(field, blocks.boxes(), BLOCK)
    model = build_scene(Boxes.empty(), blocks.boxes(), kp=config.kp, kd=config.kd)
    # at density 0 robots are put back as on blocks, so that both trials are alike but for the blocks
    reach = np.inf if config.terrain == "flat" else half - 1
    homes, levels, kinds = np.zeros((1, 3)), np.array([-1]), [config.terrain]
    return Ground(model, field, homes, levels, kinds, reach, half * 2 / 3, blocks, Boxes.empty(), among)


def _build_tiles(config: GroundConfig) -> Ground:
    """Robots start in the middles of tiles, on the level asked for or on all beyond the first."""
    tiles = TerrainConfig(seed=UNSEEN + config.seed)
    if config.terrain == "rooms":
        none = {"slope": 0.0, "rough_slope": 0.0, "stairs_up": 0.0, "stairs_down": 0.0, "discrete": 0.0}
        rooms = {"rooms": 1.0, "columns": _ROOM_COLUMNS, "block_density": config.density, "wall_blocks": 1.0}
        terrain, spread = build_terrain(replace(tiles, **none, **rooms)), _ROOM_SPREAD
        model = build_scene(terrain.tall, terrain.blocks.boxes(), kp=config.kp, kd=config.kd)
    else:
        terrain, spread = build_terrain(tiles), 0.5
        model = build_scene(Boxes.empty(), Boxes.empty(), terrain.ground, config.kp, config.kd)
    # the first level is level floor, so that 9, 8 ... 1, 9 ... has a mean of at least 5 for any number of robots
    chosen = [config.level] if config.level is not None else list(range(9, 0, -1))
    columns = len(terrain.kinds)
    # 7 has no divisor in common with 20 and 8 columns: types and levels are mixed
    pairs = [(chosen[k % len(chosen)], (7 * k) % columns) for k in range(len(chosen) * columns)]
    homes = np.array([terrain.starts[level, column] for level, column in pairs])
    levels, kinds = np.array([level for level, _ in pairs]), [terrain.kinds[column] for _, column in pairs]
    return Ground(model, terrain.ground, homes, levels, kinds, TILE / 2, spread, terrain.blocks, terrain.tall)
