"""The grids of the homes on the device, and how the kernels of the navigation environment read them. Warp compiles
these functions, Python never runs them."""

# ruff: noqa: UP018 - a variable of a kernel that changes must be made by its type
# pyright: reportInvalidTypeForm=false, reportCallIssue=false, reportArgumentType=false
# pyright: reportOperatorIssue=false, reportIndexIssue=false, reportAttributeAccessIssue=false

from typing import no_type_check

import warp as wp

from vinl.sensing.warp_start import start_warp

start_warp()
wp.set_module_options({"enable_backward": False})

FIELD = wp.constant(wp.float32(0.1))
"""Side of a cell of the distance fields [m]; the clearance grid has two cells along it."""

NOWHERE = wp.constant(wp.float32(1.0e9))
"""Stands for a distance that is not known [m]."""


@wp.struct
@no_type_check
class Homes:
    """The grids of all homes, one after another; home h begins at cell ``first[h]`` (clearance: four times that)."""

    first: wp.array(dtype=wp.int32)
    shape: wp.array(dtype=wp.vec2i)
    origin: wp.array(dtype=wp.vec2)
    clearance: wp.array(dtype=wp.float16)
    fields: wp.array(dtype=wp.float16, ndim=2)
    goals: wp.array(dtype=wp.vec2, ndim=2)
    starts: wp.array(dtype=wp.vec2, ndim=2)
    meshes: wp.array(dtype=wp.uint64)


@wp.func
@no_type_check
def read_clearance(homes: Homes, home: wp.int32, p: wp.vec2) -> wp.float32:
    """Clearance [m] between the cells' centres; 0 off the grid."""
    rows = 2 * homes.shape[home][0]
    columns = 2 * homes.shape[home][1]
    u = 2.0 * (p[0] - homes.origin[home][0]) / FIELD
    v = 2.0 * (p[1] - homes.origin[home][1]) / FIELD
    j = wp.int32(wp.floor(u))
    i = wp.int32(wp.floor(v))
    if i < 0 or j < 0 or i + 1 >= rows or j + 1 >= columns:
        return float(0.0)
    a = v - wp.float32(i)
    b = u - wp.float32(j)
    at = 4 * homes.first[home] + i * columns + j
    low = (1.0 - b) * wp.float32(homes.clearance[at]) + b * wp.float32(homes.clearance[at + 1])
    at = at + columns
    high = (1.0 - b) * wp.float32(homes.clearance[at]) + b * wp.float32(homes.clearance[at + 1])
    return (1.0 - a) * low + a * high


@wp.func
@no_type_check
def read_distance(homes: Homes, home: wp.int32, goal: wp.int32, p: wp.vec2) -> wp.float32:
    """Distance to the goal [m], weighted over those of the four cells around that know it; else ``NOWHERE``."""
    rows = homes.shape[home][0]
    columns = homes.shape[home][1]
    u = (p[0] - homes.origin[home][0]) / FIELD
    v = (p[1] - homes.origin[home][1]) / FIELD
    j = wp.int32(wp.floor(u))
    i = wp.int32(wp.floor(v))
    a = v - wp.float32(i)
    b = u - wp.float32(j)
    total = float(0.0)
    weights = float(0.0)
    for k in range(4):
        di = k // 2
        dj = k % 2
        if i + di >= 0 and j + dj >= 0 and i + di < rows and j + dj < columns:
            value = wp.float32(homes.fields[homes.first[home] + (i + di) * columns + j + dj, goal])
            weight = wp.where(di == 1, a, 1.0 - a) * wp.where(dj == 1, b, 1.0 - b)
            if wp.isfinite(value) and weight > 1.0e-6:
                total = total + weight * value
                weights = weights + weight
    if weights > 0.0:
        return total / weights
    return NOWHERE


@wp.func
@no_type_check
def follow_path(homes: Homes, home: wp.int32, goal: wp.int32, start: wp.vec2, until: wp.float32) -> wp.vec2:
    """The cell on the shortest path where the distance to the goal is ``until`` [m], or the goal's; that of ``start``
    where no cell around knows a path."""
    rows = homes.shape[home][0]
    columns = homes.shape[home][1]
    j = wp.int32(wp.floor((start[0] - homes.origin[home][0]) / FIELD + 0.5))
    i = wp.int32(wp.floor((start[1] - homes.origin[home][1]) / FIELD + 0.5))
    distance = float(NOWHERE)
    going = bool(True)
    while going:
        going = False
        to_i = int(i)
        to_j = int(j)
        for s in range(9):
            a = i + s // 3 - 1
            b = j + s % 3 - 1
            if a >= 0 and b >= 0 and a < rows and b < columns:
                value = wp.float32(homes.fields[homes.first[home] + a * columns + b, goal])
                if wp.isfinite(value) and value < distance:
                    distance = value
                    to_i = a
                    to_j = b
                    going = distance > until
        i = to_i
        j = to_j
    return homes.origin[home] + FIELD * wp.vec2(wp.float32(j), wp.float32(i))


@wp.func
@no_type_check
def touches(homes: Homes, home: wp.int32, p: wp.vec2, yaw: wp.float32, length: wp.float32, width: wp.float32) -> bool:
    """Whether the robot's rectangle reaches a wall or furniture: five discs along it and one in each corner fill it
    but for 2 cm at the corners."""
    half = 0.5 * length
    radius = 0.5 * width
    middle = read_clearance(homes, home, p)
    if middle * middle >= half * half + radius * radius:
        return False
    if middle < radius:
        return True
    along = wp.vec2(wp.cos(yaw), wp.sin(yaw))
    side = wp.vec2(-along[1], along[0])
    reach = half - radius
    for k in range(2):
        away = reach * (0.5 + 0.5 * wp.float32(k))
        if read_clearance(homes, home, p + away * along) < radius:
            return True
        if read_clearance(homes, home, p - away * along) < radius:
            return True
    corner = 0.32 * radius
    for k in range(4):
        u = wp.where(k // 2 == 0, half - corner, corner - half)
        v = wp.where(k % 2 == 0, radius - corner, corner - radius)
        if read_clearance(homes, home, p + u * along + v * side) < corner:
            return True
    return False
