"""Floor plans from pictures, where walls are what is drawn, by opacity or by darkness; and from ROS map_server maps, a
YAML file and a picture."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Bool, UInt8
from PIL import Image, UnidentifiedImageError

from vinl.config.errors import InputError
from vinl.config.loader import read_yaml
from vinl.world.boxes import Boxes
from vinl.world.floorplan import RESOLUTION, FloorPlan, assemble_floorplan, frame_around
from vinl.world.raster import drop_specks, find_inside, paint_boxes, split_rectangles

DEFAULT_RESOLUTION = 0.05
"""Metres per pixel of a picture that comes without a scale: the usual one of laser-scanned maps."""

DARK = 128
"""Grey values below this are walls."""

LEAST_FLOOR = 4.0
"""A map whose walls enclose less known floor than this [m2] has no outer walls to speak of."""

MAX_PIXELS = 49_000_000


def read_image_plan(file: Path, resolution: float | None, min_speck: int, wall_height: float) -> FloorPlan:
    """Read a bare picture; its lower left corner is the origin.

    Where the picture has transparent parts, walls are its opaque pixels; but if most of what is opaque is light, the
    light is floor, the dark is wall and the transparent is outside. Without transparency, dark is wall. Arguments are
    those of ``load_floorplan``. Raises ``InputError`` if the picture cannot be read, is empty, or encloses no floor.
    """
    colour, alpha = read_pixels(file)
    if alpha.min() == 255:
        walls = colour < DARK
        rule = "dark"
    else:
        opaque = alpha >= DARK
        dark = opaque & (colour < DARK)
        drawn = dark.any() and (opaque & ~dark).sum() > 0.5 * opaque.sum()
        walls, rule = (dark, "dark") if drawn else (opaque, "opaque")
    if not walls.any():
        raise InputError(f"{file}: the picture is empty: it has no {rule} pixels, which would be the walls")
    if walls.all():
        raise InputError(f"{file}: the whole picture is wall: all its pixels are {rule}; floor is light or transparent")
    scale = DEFAULT_RESOLUTION if resolution is None else resolution
    try:
        return build_from_pixels(file, walls, None, scale, min_speck, wall_height)
    except InputError as error:
        if walls.mean() < 0.5:
            raise
        raise InputError(
            f"{file}: {walls.mean():.0%} of the picture is {rule}, which means wall, and leaves the robot no floor; "
            "invert the picture if walls and floor are exchanged"
        ) from error


def read_pixels(file: Path) -> tuple[UInt8[np.ndarray, "rows columns"], UInt8[np.ndarray, "rows columns"]]:
    """Grey values (mean of the colours) and opacity of a picture, 0-255, top row first. Raises ``InputError`` if the
    picture cannot be read."""
    try:
        with warnings.catch_warnings():  # Pillow warns of, or refuses, what is larger than it likes
            warnings.simplefilter("error", Image.DecompressionBombWarning)
            picture = Image.open(file)
        with picture:
            if picture.width * picture.height > MAX_PIXELS:
                raise Image.DecompressionBombError
            if picture.mode.startswith(("I", "F")):
                grey = np.asarray(picture, dtype=np.float64)
                top = 65535.0 if grey.max() > 255 else 255.0
                return (grey / top * 255).astype(np.uint8), np.full(grey.shape, 255, np.uint8)
            pixels = np.asarray(picture.convert("RGBA"))
    except UnidentifiedImageError:
        raise InputError(f"{file}: this is not a picture that can be read; save it as PNG or PGM") from None
    except (Image.DecompressionBombWarning, Image.DecompressionBombError):
        raise InputError(
            f"{file}: the picture is too large: up to {MAX_PIXELS / 1e6:.0f} million pixels are read, such as 7,000 x "
            "7,000; scale it down and give its new scale, with --resolution or in the YAML of a ROS map"
        ) from None
    except (OSError, SyntaxError, ValueError) as error:
        raise InputError(f"{file}: the picture is damaged ({error}); save it again as PNG or PGM") from None
    return np.rint(pixels[..., :3].mean(-1)).astype(np.uint8), pixels[..., 3]


def build_from_pixels(
    file: Path,
    walls: Bool[np.ndarray, "rows columns"],
    known: Bool[np.ndarray, "rows columns"] | None,
    resolution: float,
    min_speck: int,
    wall_height: float,
    origin: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> FloorPlan:
    """A floor plan from masks, top row first: of walls, and of what is known to be floor (None: nothing is unknown).
    ``resolution`` is metres per pixel, ``origin`` x [m], y [m] and yaw [rad] of the picture's lower left corner."""
    walls = drop_specks(walls, min_speck)[::-1]
    if not walls.any():
        raise InputError(f"{file}: no wall is left after dropping specks of fewer than {min_speck} pixels")
    x, y, yaw = origin
    c, s = np.cos(yaw), np.sin(yaw)
    used = walls if known is None else walls | known[::-1]  # of a large empty canvas only what is drawn on it
    (left, right), (bottom, top) = (np.flatnonzero(used.any(axis))[[0, -1]] + [0, 1] for axis in (0, 1))
    corners = np.array([[left, bottom], [right, bottom], [left, top], [right, top]]) * resolution
    edges = corners @ np.array([[c, s], [-s, c]]) + [x, y]
    frame = frame_around(edges.min(0), edges.max(0), str(file))
    try:
        first_row, first_column, last_row, last_column = split_rectangles(walls).T * resolution
    except InputError as error:
        raise InputError(f"{file}: {error}") from None
    u, v = (first_column + last_column) / 2, (first_row + last_row) / 2
    n = np.ones(len(u))
    rows = [x + c * u - s * v, y + s * u + c * v, n * yaw]
    rows += [last_column - first_column, last_row - first_row, n * 0.0, n * wall_height]
    boxes = Boxes(np.column_stack(rows))
    solid = paint_boxes(boxes, frame)
    inside = find_inside(solid, RESOLUTION)
    if known is not None:
        floor = _look_up(known[::-1], frame, resolution, origin)
        inside &= floor
        if inside.sum() * RESOLUTION**2 < LEAST_FLOOR:
            # the floor borders on the unknown where walls are missing, so the unknown stands for them
            inside = find_inside(solid | ~floor, RESOLUTION) & floor
    # every second ROS map is called map.yaml: the folder tells them apart
    name = file.absolute().parent.name if file.stem == "map" else file.stem
    return assemble_floorplan(name, str(file), boxes, Boxes.empty(), inside, frame)


def _look_up(mask: np.ndarray, frame, resolution: float, origin: tuple[float, float, float]) -> np.ndarray:
    """The pixel under each cell's centre; false off the picture."""
    x, y = frame.centres()
    dx, dy = x[None] - origin[0], y[:, None] - origin[1]
    c, s = np.cos(origin[2]), np.sin(origin[2])
    column = np.floor((c * dx + s * dy) / resolution).astype(int)
    row = np.floor((c * dy - s * dx) / resolution).astype(int)
    held = (row >= 0) & (row < mask.shape[0]) & (column >= 0) & (column < mask.shape[1])
    return held & mask[np.clip(row, 0, mask.shape[0] - 1), np.clip(column, 0, mask.shape[1] - 1)]


OCCUPIED, FREE = 0.65, 0.196
"""Thresholds of maps that do not state their own [map_server]."""

UNKNOWN = 205
"""Grey value of what the robot that made the map never saw [map_server]."""


def read_ros_map(file: Path, min_speck: int, wall_height: float) -> FloorPlan:
    """Read a map: occupied pixels are walls, free ones are floor, unknown ones are neither.

    Taken from the file: ``image`` (relative to the file), ``resolution``, ``origin`` with its yaw, ``negate``,
    ``occupied_thresh``, ``free_thresh``, ``mode`` (``raw`` reads pixels as 0-100 and 255; the others share a meaning
    here). Grey 205 and transparent pixels are unknown. Raises ``InputError`` if the YAML or its picture is missing or
    broken, or encloses no floor.
    """
    entries = read_yaml(file)
    image = entries.get("image")
    if not isinstance(image, str) or not image:
        raise InputError(f"{file}: the map names no picture; add a line 'image: map.png'")
    picture = Path(image) if Path(image).is_absolute() else file.parent / image
    if not _is_there(picture):
        raise InputError(f"{file}: its picture {picture} does not exist; mend the line 'image:'")
    resolution = _read_number(file, entries, "resolution", None)
    if not 0.002 <= resolution <= 2.0:
        raise InputError(f"{file}: resolution {resolution:g} is not sensible; give metres per pixel, 0.002 to 2")
    occupied = _read_number(file, entries, "occupied_thresh", OCCUPIED)
    free = _read_number(file, entries, "free_thresh", FREE)
    if not 0 <= free <= occupied <= 1:
        raise InputError(f"{file}: thresholds must keep 0 <= free_thresh <= occupied_thresh <= 1")
    grey, alpha = read_pixels(picture)
    if entries.get("mode") == "raw":
        chance = np.where(grey > 100, 0.5 * (free + occupied), grey / 100.0)
    else:
        chance = grey / 255.0 if _read_number(file, entries, "negate", 0) else (255 - grey.astype(float)) / 255.0
        # map savers write 205 for unknown, which the free_thresh that some of them state (0.25) would call free
        chance = np.where(grey == UNKNOWN, np.clip(chance, free, occupied), chance)
    walls = (chance > occupied) & (alpha >= 128)
    known = (chance < free) & (alpha >= 128)
    if not walls.any():
        raise InputError(f"{picture}: the map has no occupied pixel; check negate and occupied_thresh in {file.name}")
    if not known.any():
        raise InputError(f"{picture}: the map has no free pixel; check negate and free_thresh in {file.name}")
    return build_from_pixels(file, walls, known, resolution, min_speck, wall_height, _read_origin(file, entries))


def _is_there(picture: Path) -> bool:
    try:
        return picture.is_file()
    except OSError:  # a name that no file can have
        return False


def _read_number(file: Path, entries: dict[str, Any], key: str, default: float | None) -> float:
    value = entries.get(key, default)
    try:
        number = float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        if value is None:
            raise InputError(f"{file}: the line '{key}:' is missing; add '{key}: 0.05'") from None
        raise InputError(f"{file}: '{key}: {value}' is not a number; mend that line") from None
    if not np.isfinite(number):
        raise InputError(f"{file}: '{key}: {value}' is not a number; mend that line")
    return number


def _read_origin(file: Path, entries: dict[str, Any]) -> tuple[float, float, float]:
    origin = entries.get("origin", [0.0, 0.0, 0.0])
    try:
        x, y, yaw = [float(v) for v in (*origin, 0.0)][:3]
    except (TypeError, ValueError):
        raise InputError(f"{file}: 'origin: {origin}' must be a list of x, y and yaw") from None
    if not np.isfinite([x, y, yaw]).all():
        raise InputError(f"{file}: 'origin: {origin}' must hold finite numbers")
    return x, y, yaw
