"""An occupancy grid of what a robot has seen around it, kept up from depth images and odometry by tensor operations."""

from __future__ import annotations

from typing import NamedTuple

import torch
from jaxtyping import Bool, Float, Int
from torch import Tensor, nn

from vinl.policies.rolling_cells import find_stale, place_cells, turned
from vinl.robot.cameras import Camera

CELL = 0.15
"""Side of a cell [m]: of the narrowest door, 0.6 m, at least one stays free however the grid lies. With 0.25 m one
door in twenty is closed."""

SIDE = 96
"""Cells along each side: 14.4 m. Cells that the robot leaves behind are used again for those ahead."""

MOUNT_HEIGHT = 0.43
"""Height of the camera over the floor [m] [recorded: 0.424 to 0.439]."""

_LOWEST, _RISE, _HIGHEST = 0.22, 0.08, 1.7
"""Points are obstacles from this height on [m], which is above what legs step over; so much higher for each metre of
distance, for the camera's pitch is known to a few degrees; and up to this height, below the lintels of doors."""

_SEEN = 8.0
"""Points farther away are not used [m]: a degree of the heading moves them by half a cell."""

_FREE_STEP = 0.2
"""Between the points of a ray whose cells are free [m]."""

_HIT, _PASSED = 0.6, 0.35
"""How far a cell moves to occupied (1) where a ray ends, and to free (-1) where one passes."""


_MET = ((0.24, 0.06), (0.12, 0.03))
"""A robot that asked for more than the first [m/s], and came no farther than the second [m], has met something that it
does not see. The second pair is for walking back."""

_BUMPS = tuple((0.45, y) for y in (-0.24, -0.12, 0.0, 0.12, 0.24))
"""Then these places of its heading frame [m], or those behind it, are occupied, whatever rays pass them, ..."""

_KNOWN_AT = tuple((0.2 + 0.1 * i, 0.1 * j) for i in range(5) for j in range(-3, 4))
"""Where one of these places [m] is known to be occupied, it may have met that: a door is not closed because the robot
touches its frame."""

_DOUBTFUL = 0.2
"""What such a step adds to the places of ``_BUMPS``: three in a row count as much as one that nothing explains."""

_FADE, PASSABLE = 0.98, 0.5
"""... until this factor at every step has brought it below the other, after 34 steps: then it may try again."""


OCCUPIED = 0.2
"""Cells above this are taken for occupied."""


class GridState(NamedTuple):
    """The grids of n robots.

    Attributes:
        pose: (1, n, 3) x, y [m] and heading [rad] since the episode began, by odometry.
        cells: (1, n, SIDE²) from free (-1) over unknown (0) to occupied (1), by what was seen.
        bumps: (1, n, SIDE²) up to 1 where something held the robot, fading.
    """

    pose: Tensor
    cells: Tensor
    bumps: Tensor


class OccupancyGrid(nn.Module):
    """Grids of n robots with a camera; holds no weights.

    Args:
        camera: what the images are of, level.
    """

    left: Tensor
    down: Tensor
    held_at: Tensor
    known_at: Tensor

    def __init__(self, camera: Camera) -> None:
        super().__init__()
        self.far, self.ahead = camera.far, camera.position[0]
        tan_x, tan_y = camera.tan_half
        across = (torch.arange(camera.width, device="cpu") + 0.5) / camera.width * 2 - 1
        down = (torch.arange(camera.height, device="cpu") + 0.5) / camera.height * 2 - 1
        self.register_buffer("left", -across * tan_x, persistent=False)
        self.register_buffer("down", down * tan_y, persistent=False)
        self.register_buffer("held_at", torch.tensor(_BUMPS, device="cpu").T.contiguous(), persistent=False)
        self.register_buffer("known_at", torch.tensor(_KNOWN_AT, device="cpu").T.contiguous(), persistent=False)

    @staticmethod
    def start(n: int, device: torch.device | str | None = None) -> GridState:
        """Grids of n robots that have seen nothing."""
        blank = [torch.zeros(1, n, SIDE**2, device=device) for _ in range(2)]
        return GridState(torch.zeros(1, n, 3, device=device), *blank)

    def see(
        self,
        state: GridState,
        depth: Float[Tensor, "n height width"],
        asked: Float[Tensor, " n"],
        step: Float[Tensor, "n 3"],
        fresh: Bool[Tensor, " n"],
    ) -> GridState:
        """After a step, with what the image shows.

        Args:
            state: before it.
            depth: as a fraction of the camera's far limit.
            asked: forward speed that the step was to have [m/s].
            step: forward, left [m] and turn [rad] since the last image, in the heading frame of that.
            fresh: an episode begins: nothing is known.
        """
        before = torch.where(fresh[:, None], 0.0, state.pose[0])
        x, y = turned(before[:, 2:], step[:, :1], step[:, 1:2])
        after = torch.where(fresh[:, None], 0.0, before + torch.cat([x, y, step[:, 2:]], 1))
        unknown = find_stale(cell_of(before), cell_of(after), SIDE).flatten(1) | fresh[:, None]
        cells, bumps = (torch.where(unknown, 0.0, part[0]) for part in (state.cells, state.bumps))
        back = asked < 0
        fast, still = (torch.where(back, behind, ahead) for ahead, behind in zip(*_MET, strict=True))
        held = (asked.abs() > fast) & (step[:, :2].square().sum(1).sqrt() < still) & ~fresh
        way = torch.where(back, -1.0, 1.0)[:, None]
        met = self._mark(after, way * self.held_at[:1], self.held_at[1:], held[:, None].expand(-1, len(_BUMPS)))
        x, y = turned(after[:, 2:], way * self.known_at[:1], self.known_at[1:])
        known = cells.gather(1, index_of(x + after[:, :1], y + after[:, 1:2])) > OCCUPIED
        bumps = (_FADE * bumps + met * torch.where(known.any(1), _DOUBTFUL, 1.0)[:, None]).clamp(max=1.0)
        hit, passed = self._trace(depth.float() * self.far, after)
        free, occupied = (torch.full((), end, device=cells.device) for end in (-1.0, 1.0))
        cells = torch.where(hit, cells.lerp(occupied, _HIT), torch.where(passed, cells.lerp(free, _PASSED), cells))
        return GridState(after[None], cells[None], bumps[None])

    def _trace(
        self, depth: Float[Tensor, "n height width"], pose: Float[Tensor, "n 3"]
    ) -> tuple[Bool[Tensor, "n cells"], Bool[Tensor, "n cells"]]:
        """Cells in which a ray ends, and cells that one passes. Each column of the image is a ray, to the nearest
        obstacle in it."""
        height = MOUNT_HEIGHT - self.down[:, None] * depth
        solid = (depth > 0) & (depth < 0.99 * self.far) & (height > _LOWEST + _RISE * depth) & (height < _HIGHEST)
        ends = torch.where(solid, depth, 2 * self.far).amin(1)  # (n, width)
        reach = torch.minimum(ends, depth.amax(1)).clamp(max=_SEEN)
        along = (torch.arange(int(_SEEN / _FREE_STEP), device=depth.device) + 0.5) * _FREE_STEP
        free = (along[:, None] < reach[:, None] - 0.5 * CELL).flatten(1)
        ahead = (self.ahead + along)[:, None].expand(-1, len(self.left)).flatten()
        left = (along[:, None] * self.left).flatten()
        passed = self._mark(pose, ahead[None], left[None], free)
        here = torch.zeros_like(pose[:, :1])
        passed = passed | self._mark(pose, here, here, torch.ones_like(here, dtype=torch.bool))
        end = ends + 0.2 * CELL  # in the cell behind the surface, not before it
        return self._mark(pose, self.ahead + end, end * self.left, ends < _SEEN), passed

    @staticmethod
    def _mark(
        pose: Float[Tensor, "n 3"],
        ahead: Float[Tensor, "#n k"],
        left: Float[Tensor, "#n k"],
        chosen: Bool[Tensor, "n k"],
    ) -> Bool[Tensor, "n cells"]:
        """The cells of the points of the heading frame that are chosen and lie on the grid."""
        x, y = turned(pose[:, 2:], ahead, left)
        limit = (SIDE // 2 - 1) * CELL
        chosen = chosen & (x.abs() < limit) & (y.abs() < limit)
        index = index_of(x + pose[:, :1], y + pose[:, 1:2]).masked_fill(~chosen, SIDE**2)
        blank = torch.zeros(len(pose), SIDE**2 + 1, dtype=torch.bool, device=pose.device)
        return blank.scatter(1, index, True)[:, :-1]


def known_cells(state: GridState) -> Float[Tensor, "n cells"]:
    """What the cells hold, by what was seen and what was met."""
    return torch.where(state.bumps[0] > PASSABLE, 1.0, state.cells[0])


def find_occupied(state: GridState) -> list[Float[Tensor, "_ 2"]]:
    """For each robot the middles of the cells that are taken for occupied, in its heading frame [m]."""
    pose, occupied = state.pose[0], known_cells(state).unflatten(1, (SIDE, SIDE)) > OCCUPIED
    cells = place_cells(cell_of(pose), SIDE)
    found = []
    for k in range(len(pose)):
        column, row = occupied[k].nonzero(as_tuple=True)
        x, y = (cells[k, 0, column] + 0.5) * CELL - pose[k, 0], (cells[k, 1, row] + 0.5) * CELL - pose[k, 1]
        found.append(torch.stack(turned(-pose[k, 2], x, y), 1))
    return found


def cell_of(place: Float[Tensor, "*n k"]) -> Int[Tensor, "*n 2"]:
    """Column and row, not wrapped, of a place [m]."""
    return torch.floor(place[..., :2] / CELL).long()


def index_of(x: Float[Tensor, "*n"], y: Float[Tensor, "*n"]) -> Int[Tensor, "*n"]:
    """Number of the cell of a place [m]."""
    column, row = (torch.floor(part / CELL).remainder(SIDE) for part in (x, y))
    return (column * SIDE + row).long()
