"""Clutter: blocks scattered over the free floor of a plan; litter, which is small: toys, shoes and books."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from vinl.config.errors import InputError
from vinl.config.loader import closest
from vinl.world.boxes import Blocks
from vinl.world.floorplan import BODY_HEIGHT, FloorPlan

_BATCH = 1024
_IDLE_BATCHES = 8


@dataclass(frozen=True)
class ClutterPreset:
    """How blocks are scattered.

    Attributes:
        density: blocks per m2 of free floor (circles around start and goal not counted).
        spacing: least distance between two blocks' centres [m].
        clear: no block's centre is nearer than this to start or goal [m].
        length: range of the long side [m].
        width: the other side, the depth to step over [m].
        height: range of the height [m].
    """

    density: float
    spacing: float = 0.75
    clear: float = 1.5
    length: tuple[float, float] = (0.2, 0.5)
    width: float = 0.2
    height: tuple[float, float] = (0.1, 0.2)


CLUTTER = {
    "none": ClutterPreset(density=0.0),
    "paper": ClutterPreset(density=1.0),
    "dense": ClutterPreset(density=1.5, spacing=0.5),
}
"""Presets by name. ``paper``: sizes, density, spacing and clear circles of [paper, IV-C]; ``dense``: more of it."""


def choose_clutter(name: str, what: str = "--obstacles") -> ClutterPreset:
    """A preset by its name; ``what`` stands before it in the error. Raises ``InputError`` if there is none of that
    name."""
    if name not in CLUTTER:
        raise InputError(f"{what} {name!r} is not a preset{closest(name, CLUTTER)}; known: {', '.join(CLUTTER)}")
    return CLUTTER[name]


def scatter_blocks(
    plan: FloorPlan, preset: ClutterPreset, rng: np.random.Generator, keep_clear: Float[np.ndarray, "k 2"]
) -> Blocks:
    """Scatter blocks on the free floor: any yaw, none in a wall or in furniture, none within ``preset.clear`` of the
    points to keep clear [m].

    Blocks are tried one after another at random places until the density is reached; where narrow floor has no more
    room there are fewer.
    """
    keep_clear = np.asarray(keep_clear, dtype=np.float64).reshape(-1, 2)
    spots = plan.frame.xy(np.argwhere(plan.free))
    for point in keep_clear:
        spots = spots[np.linalg.norm(spots - point, axis=1) >= preset.clear]
    wanted = round(preset.density * len(spots) * plan.frame.resolution**2)
    if wanted == 0:
        return Blocks.empty()
    import shapely  # only here: training on generated homes does without

    obstacles = shapely.STRtree(list(map(shapely.Polygon, plan.boxes.below(BODY_HEIGHT).corners())))
    placed = np.zeros((0, 6))
    idle = 0
    while len(placed) < wanted and idle < _IDLE_BATCHES:
        fitting = _fit(_draw(spots, preset, rng, plan.frame.resolution), plan, obstacles)
        for point in keep_clear:
            fitting = fitting[np.linalg.norm(fitting[:, :2] - point, axis=1) >= preset.clear]
        before = len(placed)
        for row in fitting:
            if len(placed) == wanted:
                break
            if len(placed) == 0 or np.linalg.norm(placed[:, :2] - row[:2], axis=1).min() >= preset.spacing:
                placed = np.vstack([placed, row])
        idle = idle + 1 if len(placed) == before else 0
    return Blocks(placed)


def _draw(spots: np.ndarray, preset: ClutterPreset, rng: np.random.Generator, cell: float) -> np.ndarray:
    n = _BATCH
    xy = spots[rng.integers(len(spots), size=n)] + rng.uniform(-cell / 2, cell / 2, (n, 2))
    yaw = rng.uniform(-np.pi, np.pi, n)
    length, height = rng.uniform(*preset.length, n), rng.uniform(*preset.height, n)
    return np.column_stack([xy, yaw, length, np.full(n, preset.width), height])


def _fit(rows: np.ndarray, plan: FloorPlan, obstacles: Any) -> np.ndarray:
    """The rows whose whole footprint is inside the building and touches no wall and no furniture."""
    import shapely

    corners = Blocks(rows).boxes().corners()
    outline = np.concatenate([corners, (corners + np.roll(corners, 1, axis=1)) / 2], axis=1)
    cells = plan.frame.cell(outline)
    fits = np.all(plan.inside[cells[..., 0], cells[..., 1]], axis=1)
    hit, _ = obstacles.query(shapely.polygons(corners), predicate="intersects")
    fits[hit] = False
    return rows[fits]


LITTER_SIDE = (0.05, 0.15)
"""Range of both sides of an object [m]."""

LITTER_HEIGHT = (0.03, 0.10)
"""Range of its height [m]."""


def draw_litter(rng: np.random.Generator, density: float, half: float) -> Blocks:
    """Objects, ``density`` per m2, at random places of the square |x|, |y| <= half [m], with any yaw; they may lie on
    one another."""
    n = round(density * (2 * half) ** 2)
    places, yaw = rng.uniform(-half, half, (n, 2)), rng.uniform(0, np.pi, n)
    return Blocks(np.column_stack([places, yaw, rng.uniform(*LITTER_SIDE, (n, 2)), rng.uniform(*LITTER_HEIGHT, n)]))
