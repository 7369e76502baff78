"""A home from a number."""

from __future__ import annotations

from random import Random

import numpy as np

from vinl.config.errors import InputError
from vinl.world.boxes import Boxes
from vinl.world.floorplan import RESOLUTION, FloorPlan, RoomLabel, assemble_floorplan, frame_around
from vinl.world.homes.config import HomeConfig
from vinl.world.homes.furnish import furnish
from vinl.world.homes.offices import draw_office
from vinl.world.homes.reach import CHECKED_AT, keep_connected, paint_rects
from vinl.world.homes.rooms import Room, draw_rooms, measure
from vinl.world.homes.walls import Shell, raise_shell

ATTEMPTS = 100
"""Layouts drawn for a home before the ranges are taken for impossible; one to three are the rule."""

IMPOSSIBLE = "homes: no home fits the config; widen its ranges (area, corridor_width, door_width)"


def generate_home(seed: int, config: HomeConfig | None = None, resolution: float = RESOLUTION) -> FloorPlan:
    """Generate a home: rooms, walls, doors, furniture. The same seed gives the same home.

    Every room can be reached by a robot of radius ``free_space.FIT_RADIUS``; furniture that would prevent it is left
    away.

    Args:
        seed: 0 or more.
        config: what homes are like; ``HomeConfig()`` if left away.
        resolution: side of the cells of the plan's grids [m], 0.02 to 0.1; walls and furniture do not depend on it.

    Raises:
        InputError: if the seed is negative, the resolution out of range, or no home fits the config.
    """
    config = config or HomeConfig()
    if seed < 0:
        raise InputError(f"homes: the seed must be 0 or more, got {seed}")
    if not 0.02 <= resolution <= CHECKED_AT:
        raise InputError(f"homes: the resolution must lie between 0.02 m and {CHECKED_AT} m, got {resolution:g}")
    rng = Random(seed)
    name = f"home-{seed}"
    for _ in range(ATTEMPTS):
        shell = _draw_shell(rng, config)
        walls = Boxes(np.array(shell.walls))
        rects = [rect for room in shell.rooms for rect in room.rects]
        corners = np.array(rects)
        low, high = corners[:, :2].min(0), corners[:, 2:].max(0)
        frame = frame_around(low, high, name, CHECKED_AT)
        inside = paint_rects(rects, frame)
        pieces = keep_connected(shell.rooms, walls, furnish(rng, shell, config), inside, frame)
        if pieces is None:
            continue
        if resolution != CHECKED_AT:
            frame = frame_around(low, high, name, resolution)
            inside = paint_rects(rects, frame)
        furniture = Boxes(np.array([row for piece in pieces for row in piece.rows]).reshape(-1, 7))
        panes = Boxes(np.array(shell.panes).reshape(-1, 7))
        labels = tuple(_label(room) for room in shell.rooms)
        return assemble_floorplan(name, f"generated:{seed}", walls, furniture, inside, frame, panes, labels, roomy=True)
    raise InputError(IMPOSSIBLE)


def draw_shell(seed: int, config: HomeConfig) -> tuple[Random, Shell]:
    """The rooms, walls and doors that a seed is tried with first, and the chance to draw the furniture from.

    Raises:
        InputError: if no home fits the config.
    """
    rng = Random(seed)
    shell = _draw_shell(rng, config)
    return rng, shell


def _draw_shell(rng: Random, config: HomeConfig) -> Shell:
    for _ in range(ATTEMPTS):
        rooms = draw_office(rng, config) if config.layout == "office" else draw_rooms(rng, config)
        if not config.area[0] <= sum(room.area for room in rooms) <= config.area[1]:
            continue
        shell = raise_shell(rng, rooms, config)
        if shell is not None:
            return shell
    raise InputError(IMPOSSIBLE)


def _label(room: Room) -> RoomLabel:
    x0, y0, x1, y1 = max(room.rects, key=measure)
    return RoomLabel(room.kind, (x0 + x1) / 2, (y0 + y1) / 2)
