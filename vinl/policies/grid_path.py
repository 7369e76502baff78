"""The shortest path to the goal on an occupancy grid that takes what is unknown for free: where it leads, and how long
it is. With every wall that is seen it is planned anew; a dead end is left as soon as the grid shows that it is one."""

from __future__ import annotations

from collections.abc import Callable

import torch
import torch.nn.functional as F
from jaxtyping import Bool, Float
from torch import Tensor

from vinl.policies.occupancy_grid import CELL, OCCUPIED, SIDE, GridState, cell_of, known_cells

AHEAD = (5, 10, 20)
"""The path is told at so many cells from the robot: 0.75 to 3 m, more where it is oblique."""

PLAN_SIZE = 2 * len(AHEAD) + 2
"""Numbers that ``plan_path`` gives."""

_STEPS = 128
"""Distances spread by one cell in each: paths of up to 19 m within the grid."""

_FREE = -0.1
"""Cells below this are taken for free."""

_OUTSIDE = 20.0
"""How much longer than straight a way through what is not on the grid is taken to be, if the goal is on it [m]."""

_NEAR, _AROUND, _UNSURE, _THROUGH = 2.0, 0.5, 12.0, 100.0
"""What a metre costs, beyond its length: beside an occupied cell; one cell farther away; beside one and not known to be
free, which is how walls look that were seen in part; and through one that is occupied for sure, for no grid is so sure
that there is no path."""

_AT_A_TIME = 16
"""Grids that are planned on at once on a CPU: they fit its cache."""

FAR = 1e3
"""Before anything is known of a cell's distance [m]."""

Spread = Callable[[Tensor, Tensor], Tensor]


def spread(distance: Float[Tensor, "n side side"], cost: Float[Tensor, "n side side"]) -> Float[Tensor, "n side side"]:
    """Distances [m] after ``_STEPS`` steps to the eight neighbours, whose cells are crossed at this cost [m]; on a CPU
    only until no distance becomes shorter."""
    watched = distance.device.type == "cpu" and not torch.compiler.is_compiling()
    diagonal = cost * 2.0**0.5
    for k in range(_STEPS):
        before, d = distance, F.pad(distance, (1, 1, 1, 1), value=FAR)
        up, down, middle = d[:, :-2], d[:, 2:], d[:, 1:-1]
        beside = torch.minimum(middle[..., :-2], middle[..., 2:])
        straight = torch.minimum(torch.minimum(up[..., 1:-1], down[..., 1:-1]), beside)
        upper, lower = torch.minimum(up[..., :-2], up[..., 2:]), torch.minimum(down[..., :-2], down[..., 2:])
        oblique = torch.minimum(upper, lower)
        distance = torch.minimum(distance, torch.minimum(straight + cost, oblique + diagonal))
        if watched and k % 8 == 7 and torch.equal(before, distance):  # elsewhere to look would be to wait
            break
    return distance


def plan_path(state: GridState, goal: Float[Tensor, "n 2"], spreading: Spread = spread) -> Float[Tensor, "n plan"]:
    """What a robot is told of the path.

    Args:
        state: of the grids.
        goal: in the heading frame [m]; outside of the grid the way to it is taken for straight.
        spreading: ``spread``, or what does the same.

    Returns:
        Cosine and sine of the bearing of the path's points ``AHEAD``; its length / 10 m, held to 4; and how much longer
        it is than the straight line / 5 m, held to 4.
    """
    pose = state.pose[0]
    c, s = pose[:, 2].cos(), pose[:, 2].sin()
    towards = torch.stack([c * goal[:, 0] - s * goal[:, 1], s * goal[:, 0] + c * goal[:, 1]], 1)  # in the grid's axes
    here = cell_of(pose)
    around = torch.arange(SIDE, device=pose.device) - SIDE // 2
    column, row = ((here[:, k, None] + around).remainder(SIDE) for k in (0, 1))
    columns, rows = column[:, :, None].expand(-1, -1, SIDE), row[:, None, :].expand(-1, SIDE, -1)
    cells = (
        known_cells(state).unflatten(1, (SIDE, SIDE)).gather(1, columns).gather(2, rows)
    )  # the robot's is in the middle
    middles = (here[..., None] + around + 0.5) * CELL - pose[:, :2, None]  # (n, 2, SIDE) from the robot
    x, y = middles[:, 0, :, None] - towards[:, :1, None], middles[:, 1, None, :] - towards[:, 1:, None]
    straight = (x * x + y * y).sqrt()
    distance = spread_distances(cells, straight, spreading)
    return _describe(distance, middles, towards, c, s)


def spread_distances(
    cells: Float[Tensor, "n side side"], straight: Float[Tensor, "n side side"], spreading: Spread = spread
) -> Float[Tensor, "n side side"]:
    """Length of the path from each cell to the goal [m], with what it costs to come near to something.

    Args:
        cells: see ``GridState``, the robot's in the middle.
        straight: distance of each cell to the goal [m].
    """
    if cells.device.type == "cpu" and len(cells) > _AT_A_TIME and not torch.compiler.is_compiling():
        parts = zip(cells.split(_AT_A_TIME), straight.split(_AT_A_TIME), strict=True)
        return torch.cat([spread_distances(*part, spreading) for part in parts])
    wall = close_corners(cells.clamp(min=OCCUPIED))
    near = _grown(wall > OCCUPIED)
    beside = torch.where(cells > _FREE, _NEAR + _UNSURE, _NEAR)
    dearer = torch.where(near, beside, torch.where(_grown(near), _AROUND, 0.0))
    cost = CELL * (1 + dearer + _THROUGH / (1 - OCCUPIED) * (wall - OCCUPIED))
    edge = torch.ones_like(near[:1])
    edge[:, 1:-1, 1:-1] = False
    at_goal = straight < 0.75 * CELL
    beyond = straight + _OUTSIDE * at_goal.flatten(1).any(1)[:, None, None]
    distance = torch.where(at_goal, straight, torch.where(edge, beyond, FAR))
    return spreading(distance, cost)


def _grown(cells: Bool[Tensor, "n side side"]) -> Bool[Tensor, "n side side"]:
    """These and their eight neighbours."""
    c = F.pad(cells, (1, 1, 1, 1))
    column = c[:, :-2] | c[:, 1:-1] | c[:, 2:]
    return column[..., :-2] | column[..., 1:-1] | column[..., 2:]


def close_corners(wall: Float[Tensor, "n side side"]) -> Float[Tensor, "n side side"]:
    """Cells that have a wall both above or below and to the left or right become as much of one as these: an oblique
    wall is a flight of stairs on the grid, and a path would slip through between two steps."""
    w = F.pad(wall, (1, 1, 1, 1), value=OCCUPIED)
    over = torch.maximum(w[:, :-2, 1:-1], w[:, 2:, 1:-1])
    beside = torch.maximum(w[:, 1:-1, :-2], w[:, 1:-1, 2:])
    return torch.maximum(wall, torch.minimum(over, beside))


def _describe(distance: Tensor, middles: Tensor, towards: Tensor, c: Tensor, s: Tensor) -> Tensor:
    n, rows = len(distance), torch.arange(len(distance), device=distance.device)
    flat = distance.flatten(1)
    nine = torch.arange(9, device=distance.device)
    offsets = torch.stack([nine // 3 - 1, nine % 3 - 1], 1)  # of a cell and its neighbours
    at = torch.full((n, 2), SIDE // 2, device=distance.device)
    told: list[Tensor] = []
    for k in range(1, AHEAD[-1] + 1):  # downhill, cell by cell
        around = (at[:, None] + offsets).clamp(0, SIDE - 1)
        best = flat.gather(1, around[..., 0] * SIDE + around[..., 1]).argmin(1)
        at = around[rows, best]
        if k in AHEAD:
            to_x, to_y = (middles[:, axis].gather(1, at[:, axis : axis + 1])[:, 0] for axis in (0, 1))
            away = (to_x * to_x + to_y * to_y).sqrt().clamp(min=0.5 * CELL)
            told += [(c * to_x + s * to_y) / away, (c * to_y - s * to_x) / away]
    length, line = distance[:, SIDE // 2, SIDE // 2], (towards * towards).sum(1).sqrt()
    return torch.stack([*told, (length / 10).clamp(max=4), ((length - line) / 5).clamp(-1, 4)], 1)
