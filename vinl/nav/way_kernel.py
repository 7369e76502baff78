"""The Warp kernel that tells where the shortest way leads. A file of its own: Warp compiles it."""


# pyright: reportInvalidTypeForm=false, reportCallIssue=false, reportArgumentType=false
# pyright: reportOperatorIssue=false, reportIndexIssue=false, reportAttributeAccessIssue=false

from typing import no_type_check

import warp as wp

from vinl.nav.grids import Homes, read_distance
from vinl.nav.robots import Robots
from vinl.sensing.warp_start import start_warp

start_warp()
wp.set_module_options({"enable_backward": False})

_HOPS = wp.constant(4)
_REACH = wp.constant(0.2)
"""Length of a hop [m]: two cells of the field, and less than what lies between a robot and the far side of a wall."""

_DIRECTIONS = wp.constant(24)


@wp.kernel
@no_type_check
def point_ways(homes: Homes, robots: Robots, way: wp.array(dtype=wp.vec2)):
    """Unit vector, in the robot's frame (forward, left), to the place where hops down the distance field end; zero
    at the goal."""
    n = wp.tid()
    home = robots.home[n]
    goal = robots.goal[n]
    here = robots.position[n]
    for _ in range(_HOPS):
        best = read_distance(homes, home, goal, here)
        lowest = here
        for k in range(_DIRECTIONS):
            angle = 2.0 * wp.pi * wp.float32(k) / wp.float32(_DIRECTIONS)
            there = here + _REACH * wp.vec2(wp.cos(angle), wp.sin(angle))
            distance = read_distance(homes, home, goal, there)
            if distance < best:
                best = distance
                lowest = there
        here = lowest
    to = wp.normalize(here - robots.position[n])
    c = wp.cos(robots.yaw[n])
    s = wp.sin(robots.yaw[n])
    way[n] = wp.vec2(c * to[0] + s * to[1], c * to[1] - s * to[0])
