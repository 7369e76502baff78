"""Floor plans from triangle meshes: scans and models of homes as GLB, OBJ, PLY or STL."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from jaxtyping import Float, Int

from vinl.config.errors import InputError
from vinl.world.floorplan import FloorPlan, assemble_floorplan, frame_around
from vinl.world.readers.columns import Columns, find_columns
from vinl.world.readers.enclosure import find_inside
from vinl.world.start_goal import check_way

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
    """Read a floor plan from a mesh of one storey, or of the lowest of several.

    The floor is found by its level surface. What rises between ``columns.STEP`` and 0.6 m above it stands in the
    robot's way; what goes on up to 1.7 m is a wall, the rest furniture.

    Args:
        file: the mesh; all objects of a scene count.
        up: x, y, z, -x, -y or -z; ``None`` takes y for glTF, as that format says, and for the others y or z,
            whichever the mesh is shorter along: homes are wider than high.
        scale: metres per unit; ``None`` takes 1 and refuses what cannot be in metres.
        wall_height: what is higher above the floor is left out: ceilings, upper storeys [m].

    Raises:
        InputError: if the file is broken or holds no triangles, has no floor, is not in metres, or there is no room
            or no path for the robot.
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
