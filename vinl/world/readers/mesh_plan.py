"""Floor plans from triangle meshes: scans and models of homes as GLB, OBJ, PLY or STL. The surface is sorted into cells
and layers: what stands above each cell, from which height to which."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.ndimage import binary_closing, maximum

from vinl.config.errors import InputError
from vinl.world.boxes import Boxes
from vinl.world.floorplan import BODY_HEIGHT, FloorPlan, assemble_floorplan, frame_around, measure_clearance
from vinl.world.grid import GridFrame
from vinl.world.raster import find_inside, label_regions, split_rectangles
from vinl.world.start_goal import check_way

STEP = 0.08
"""What rises less than this above the floor is walked over [m]: rugs, thresholds, noise of a scan."""

SLICE = 0.1
"""Height of the layers that the space above the floor is cut into [m]."""

WALL_FROM = 1.7
"""What begins near the floor and reaches this height is a wall [m]."""

OVERHEAD = 2.2
"""What begins above this height is left out [m]: ceilings, lamps."""

FLAT = 0.12
"""Surface within this of the floor's height is floor [m]."""

NICHE = 1.5
"""Floor shut in by walls or furniture with less than this is not floor but the inside of a thing [m2]."""

NARROW = 0.2
"""What is shut in and nowhere has this distance to its sides is the inside of a wall or a chest [m]."""

_CHUNK = 2_000_000


@dataclass(frozen=True, eq=False)
class Columns:
    """What stands on each cell of a grid: whether there is surface in each layer of ``SLICE`` above ``STEP``, whether
    there is floor; and how high walls are [m]."""

    frame: GridFrame
    layers: Bool[np.ndarray, "layers rows columns"]
    floor: Bool[np.ndarray, "rows columns"]
    wall_height: float

    @property
    def low(self) -> Bool[np.ndarray, "rows columns"]:
        """Cells with something in the robot's way."""
        return np.logical_or.reduce(self.layers[: _layer(BODY_HEIGHT)])

    @property
    def tall(self) -> Bool[np.ndarray, "rows columns"]:
        """Cells under walls: surface in most layers from the floor up to ``WALL_FROM``."""
        fraction: np.ndarray = self.layers[: _layer(WALL_FROM)].mean(0)  # type: ignore[assignment]
        return fraction >= 0.8

    def boxes(self) -> tuple[Boxes, Boxes]:
        """Walls and furniture as boxes that cover the cells exactly; what they shut in and is too small to stand in
        belongs to them."""
        tall = _close(self.tall)
        solid = tall | self.low
        niches = label_regions(~solid)
        count = int(niches.max()) + 1
        small = np.bincount(niches.ravel()) * self.frame.resolution**2 < NICHE
        small |= maximum(measure_clearance(~solid, self.frame.resolution), niches, np.arange(count)) < NARROW
        small[0] = False
        # between the two faces of a wall there is wall, inside a chest there is furniture
        around = [np.bincount(grid.ravel(), minlength=count) for grid in _neighbours(niches, tall)]
        walled = small & (around[1] > 0.8 * np.maximum(around[0], 1))
        hollow = walled[niches]
        filled = (small & ~walled)[niches]
        walls = [self._raise(tall | hollow, 0.0, self.wall_height)]
        rows = [self._raise(filled, 0.0, 1.0)]
        for bottom, top, cells in self._runs(~(tall | hollow)):
            lintel = bottom >= BODY_HEIGHT and top >= self.wall_height - 2 * SLICE
            (walls if lintel else rows).append(self._raise(cells & ~filled, bottom, top))
        return Boxes(np.concatenate(walls)), Boxes(np.concatenate(rows))

    def _runs(self, kept: np.ndarray) -> Iterator[tuple[float, float, np.ndarray]]:
        """Bottom, top and cells of the stretches of layers with surface, those of equal bottom and top together."""
        layers = self.layers & kept
        count = len(layers)
        empty = np.zeros_like(layers[:1])
        begins = layers & ~np.concatenate([empty, layers[:-1]])
        for first in range(min(count, _layer(OVERHEAD))):
            alive = begins[first]
            for last in range(first, count):
                if not alive.any():
                    break
                ends = alive & ~(layers[last + 1] if last + 1 < count else empty[0])
                if ends.any():
                    bottom = 0.0 if first == 0 else STEP + first * SLICE
                    yield bottom, STEP + (last + 1) * SLICE, ends
                alive = alive & ~ends

    def _raise(self, cells: np.ndarray, bottom: float, top: float) -> np.ndarray:
        found = split_rectangles(cells)
        low, high = found[:, [1, 0]] - 0.5, found[:, [3, 2]] - 0.5
        origin, pitch = np.array([self.frame.x0, self.frame.y0]), self.frame.resolution
        middle, size = origin + (low + high) / 2 * pitch, (high - low) * pitch
        n = len(found)
        return np.column_stack([middle, np.zeros(n), size, np.full(n, bottom), np.full(n, top)])


def find_columns(triangles: Float[np.ndarray, "f 3 3"], frame: GridFrame, wall_height: float) -> Columns:
    """Sort the surface of triangles [m], whose floor is at z = 0, into cells and layers, sampled every half cell. What
    is above ``wall_height`` [m] is left out."""
    count = max(_layer(wall_height), _layer(WALL_FROM))
    layers = np.zeros((count, *frame.shape), bool)
    floor = np.zeros(frame.shape, bool)
    highest = min(wall_height, float(triangles[..., 2].max()))
    triangles = triangles[(triangles[..., 2].max(1) > -FLAT) & (triangles[..., 2].min(1) < wall_height)]
    for points in _sample(triangles, frame.resolution / 2):
        z = points[:, 2]
        cell = frame.cell(points[:, :2])
        flat = np.abs(z) <= FLAT
        floor[cell[flat, 0], cell[flat, 1]] = True
        layer = np.floor((z - STEP) / SLICE).astype(int)
        held = (z >= STEP) & (layer < count)
        layers[layer[held], cell[held, 0], cell[held, 1]] = True
    return Columns(frame, layers, binary_closing(np.pad(floor, 3), iterations=2)[3:-3, 3:-3], highest)


def _sample(triangles: Float[np.ndarray, "f 3 3"], spacing: float) -> Iterator[Float[np.ndarray, "n 3"]]:
    """Points on triangles, no farther apart than ``spacing`` [m], corners included."""
    longest = np.linalg.norm(triangles - np.roll(triangles, 1, axis=1), axis=2).max(1)
    parts = np.maximum(np.ceil(longest / spacing), 1).astype(int)
    # few sizes of lattice: the next power of sqrt(2)
    parts = np.ceil(np.sqrt(2.0) ** np.ceil(np.log2(parts) * 2)).astype(int)
    for n in np.unique(parts):
        i, j = np.meshgrid(np.arange(n + 1), np.arange(n + 1), indexing="ij")
        i, j = i[i + j <= n], j[i + j <= n]
        weights = np.column_stack([i, j, n - i - j]) / n
        group = triangles[parts == n]
        batch = max(_CHUNK // len(weights), 1)
        for k in range(0, len(group), batch):
            for at in range(0, len(weights), _CHUNK):
                yield np.einsum("wk,fkd->fwd", weights[at : at + _CHUNK], group[k : k + batch]).reshape(-1, 3)


def _close(mask: np.ndarray) -> np.ndarray:
    """The mask without holes and cracks of one or two cells."""
    closed: np.ndarray = binary_closing(np.pad(mask, 2), np.ones((3, 3), bool))  # type: ignore[assignment]
    return closed[2:-2, 2:-2]


def _neighbours(niches: np.ndarray, tall: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Numbers of the niches once for each of their cells' neighbours that are not in one, and for those under walls."""
    n = np.pad(niches, 1)
    t = np.pad(tall, 1)
    shifts = [(0, 1), (0, -1), (1, 0), (-1, 0)]
    edges = [np.where((n > 0) & (np.roll(n, shift, (0, 1)) == 0), n, 0) for shift in shifts]
    walled = [np.where(np.roll(t, shift, (0, 1)), edge, 0) for shift, edge in zip(shifts, edges, strict=True)]
    return np.stack(edges), np.stack(walled)


def _layer(height: float) -> int:
    """Number of layers up to a height [m]."""
    return round((height - STEP) / SLICE)


AXES = {"x": 0, "y": 1, "z": 2}

LEVEL = 0.96
"""Cosine of the steepest slope that counts as floor: 16 degrees."""

FLOOR_AREA = 2.0
"""Least floor at one height [m2]."""

FLOOR_FRACTION = 0.25
"""The floor is the lowest height with at least this fraction of what the height with the most level surface has."""

BIN = 0.05
"""Heights are counted in bins of this size [m]."""

HIGHEST, WIDEST, LOWEST = 15.0, 150.0, 1.0
"""A home in metres is neither higher nor wider than this, nor lower [m]."""

UNITS = {"millimetres": 0.001, "centimetres": 0.01, "inches": 0.0254, "decimetres": 0.1}

SHELL = 4.0
"""If walls enclose less than this [m2], the mesh has no closed walls and its floor says what is inside."""


def read_mesh_plan(file: Path, up: str | None, scale: float | None, wall_height: float) -> FloorPlan:
    """Read a floor plan from a mesh of one storey, or of the lowest of several; arguments are those of
    ``load_floorplan``. Without ``scale`` what cannot be in metres is refused.

    The floor is found by its level surface. What rises between ``mesh_plan.STEP`` and 0.6 m above it stands in the
    robot's way; what goes on up to 1.7 m is a wall, the rest furniture. Raises ``InputError`` if the file is broken or
    holds no triangles, has no floor, is not in metres, or there is no room or no path for the robot.
    """
    vertices, faces = _load(file)
    size = vertices.max(0) - vertices.min(0)
    lies = file.suffix.lower() in (".glb", ".gltf") or size[1] < size[2]
    up = up or ("y" if lies else "z")
    vertices = _turn_up(vertices, up) * (scale or 1.0)
    if scale is None:
        _check_units(vertices, file)
    triangles = vertices[faces]
    height = _find_floor(triangles, file, up)
    triangles = triangles - np.array([0.0, 0.0, height])
    low, high = triangles[..., :2].min((0, 1)), triangles[..., :2].max((0, 1))
    frame = frame_around(low, high, str(file))
    columns = find_columns(triangles, frame, wall_height)
    inside = _find_inside(columns, frame.resolution)
    walls, furniture = columns.boxes()
    return check_way(assemble_floorplan(file.stem, str(file), walls, furniture, inside, frame))


def _load(file: Path) -> tuple[Float[np.ndarray, "v 3"], Int[np.ndarray, "f 3"]]:
    import trimesh  # only here: other plans do without

    try:
        mesh = trimesh.load(file, force="mesh", process=False)
        vertices, faces = np.asarray(mesh.vertices, dtype=np.float64), np.asarray(mesh.faces)  # type: ignore[union-attr]
    except Exception as error:  # the loaders raise whatever comes
        reason = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise InputError(f"{file}: the mesh cannot be read ({reason}); is the file complete?") from None
    if vertices.shape != (len(vertices), 3) or not len(vertices) or not len(faces):
        raise InputError(f"{file}: the mesh has no triangles (a cloud of points is not enough)")
    if faces.min() < 0 or faces.max() >= len(vertices):
        raise InputError(f"{file}: a triangle names a vertex that the mesh does not have; is the file complete?")
    if not np.isfinite(vertices).all():
        raise InputError(f"{file}: the mesh has a vertex that is not a number")
    return vertices, faces


def _turn_up(vertices: np.ndarray, up: str) -> np.ndarray:
    """The vertices with z up, turned and not mirrored."""
    name = up.removeprefix("+").lower()
    if name.removeprefix("-") not in AXES:
        raise InputError(f"--up {up}: choose one of x, y, z, -x, -y, -z")
    k = AXES[name.removeprefix("-")]
    sign = -1.0 if name.startswith("-") else 1.0
    first, second = (k + 1) % 3, (k + 2) % 3
    turned = [vertices[:, first], vertices[:, second], vertices[:, k]]
    # y up becomes (z, x, y); as a plan people expect x to the right: (x, -z, y)
    if k == 1:
        turned = [vertices[:, 0], -vertices[:, 2], vertices[:, 1]]
    if sign < 0:
        turned = [turned[0], -turned[1], -turned[2]]
    return np.stack(turned, -1)


def _check_units(vertices: np.ndarray, file: Path) -> None:
    size = vertices.max(0) - vertices.min(0)
    found = f"{size[0]:.4g} x {size[1]:.4g} m and {size[2]:.4g} m high"
    if size[2] > HIGHEST or size[:2].max() > WIDEST:
        fits = {name: abs(np.log(size[2] * scale / 2.6)) for name, scale in UNITS.items()}
        unit = min(fits, key=lambda name: fits[name])
        raise InputError(
            f"{file}: the mesh would be {found}, its doors {size[2] * 2.0 / 2.6:.0f} m high; it seems to be in {unit}: "
            f"give --resolution {UNITS[unit]:g} (metres per unit), or 1 if it is right"
        )
    if size[2] < LOWEST or size[:2].max() < LOWEST:
        raise InputError(
            f"{file}: the mesh would be {found}, too small for a home; give metres per unit with --resolution, or the "
            "axis that points up with --up"
        )


def _find_floor(triangles: Float[np.ndarray, "f 3 3"], file: Path, up: str) -> float:
    """Height of the floor [m]: the lowest height with much level surface that faces up, or, where the mesh does not
    say which side is out, that faces up or down."""
    across = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    area = np.linalg.norm(across, axis=1) / 2
    slope = across[:, 2] / np.maximum(2 * area, 1e-12)
    z = triangles[..., 2].mean(1)
    best = 0.0
    for facing in (slope, np.abs(slope)):
        level = facing > LEVEL
        if not level.any():
            continue
        bins = np.floor((z[level] - z[level].min()) / BIN).astype(int)
        areas = np.bincount(bins, area[level])
        pooled = areas + np.append(areas[1:], 0.0)  # a floor on the edge of two bins counts once
        best = max(best, float(pooled.max()))
        high = np.flatnonzero((pooled >= FLOOR_AREA) & (pooled >= FLOOR_FRACTION * pooled.max()))
        if len(high):
            there = (bins >= high[0]) & (bins <= high[0] + 1)
            return float(np.average(z[level][there], weights=area[level][there]))
    raise InputError(
        f"{file}: a mesh without a floor: at no height is there more than {best:.1f} m2 of level surface, "
        f"{FLOOR_AREA:g} m2 are needed; does {up} really point up (--up)?"
    )


def _find_inside(columns: Columns, resolution: float) -> np.ndarray:
    """Floor that walls enclose; all floor, if they enclose next to nothing."""
    enclosed = find_inside(columns.tall, resolution)
    floor = columns.floor | columns.low  # furniture may hide the floor from a scanner
    within = enclosed & floor
    if within.sum() * resolution**2 >= max(SHELL, 0.3 * (columns.floor & ~columns.tall).sum() * resolution**2):
        return within
    return columns.floor & ~columns.tall
