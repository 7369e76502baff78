"""Floor plans from ROS ``map_server`` maps: a YAML file and a picture."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from vinl.config.errors import InputError
from vinl.config.yaml_text import read_yaml
from vinl.world.floorplan import FloorPlan
from vinl.world.readers.image import build_from_pixels, read_pixels

OCCUPIED, FREE = 0.65, 0.196
"""Thresholds of maps that do not state their own [map_server]."""

UNKNOWN = 205
"""Grey value of what the robot that made the map never saw [map_server]."""


def read_ros_map(file: Path, min_speck: int, wall_height: float) -> FloorPlan:
    """Read a map: occupied pixels are walls, free ones are floor, unknown ones are neither.

    Taken from the file: ``image`` (relative to the file), ``resolution``, ``origin`` with its yaw, ``negate``,
    ``occupied_thresh``, ``free_thresh``, ``mode`` (``raw`` reads pixels as 0-100 and 255; the others share a meaning
    here). Grey 205 and transparent pixels are unknown.

    Raises:
        InputError: if the YAML or its picture is missing or broken, or encloses no floor.
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
