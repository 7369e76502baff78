"""An elevation map about the robot, from depth images and dead reckoning: what the camera saw stays where it lies while
the robot walks over it.

Nothing in it is learned. Points of a depth image are turned upright by the direction of gravity, set on the floor that
the image itself shows, and kept in square cells that do not move; the robot moves among them by its own estimate of
its velocity [Fankhauser et al. 2014: robot-centric elevation mapping]. All of it is array operations of fixed shape, so
that an exported policy carries it along.
"""

from __future__ import annotations

from typing import NamedTuple

import torch
from jaxtyping import Bool, Float, Int
from torch import Tensor, nn

from vinl.gait.local_map import POINTS, WALL
from vinl.policies.rolling_cells import find_stale, turned
from vinl.robot.aliengo import CONTROL_DT
from vinl.robot.cameras import Camera

CELL = 0.025
"""Side of a cell [m]: half of those that the planner reads, so that turning the map moves no edge by more."""

SIDE = 112
"""Cells along each side: 2.8 m, what the planner reads at any heading. Cells that the robot leaves behind are used
again for those ahead."""

_PER_SIDE = 1 / SIDE

UNSEEN = -10.0
"""Height of a cell that no image showed [m]."""

NEAR = 1.1
"""Points farther ahead of the trunk's middle are not used [m]: there a row of the image is wider than a cell of the
planner, and an angle's error lifts the floor to an obstacle."""

AGES = 8
"""Control steps of which the poses are remembered: images are up to 0.14 s old when they come."""

_BLEND = 0.5
"""How far a cell moves to what the newest image shows."""

_WEAR = 0.05
"""How far a wall's cell moves to an image that shows floor there."""

_FLOOR = 0.03
"""Points so near to the floor that the legs tell of are taken for floor [m], ..."""

_SURE = 20.0
"""... and tilt it as if so many points lay on the legs' floor."""

_ROUGH = 0.02
"""What rises less is floor to the planner [m]."""

_QUARTERS = ((-1, -1), (-1, 1), (1, -1), (1, 1))


class MapState(NamedTuple):
    """What is remembered from step to step.

    Attributes:
        pose: (n, 3) x, y [m] and heading [rad] since the episode began, by dead reckoning.
        heights: (n, 12544) of the highest point in each cell above the floor [m]; ``UNSEEN``.
        recent: (n, 8, 13) how the robot stood in the last control steps, the newest first: its pose, the axes of its
            heading frame in the trunk's, and the height of the floor in that frame [m]; zeros before the episode.
    """

    pose: Tensor
    heights: Tensor
    recent: Tensor


class ElevationMap(nn.Module):
    """Maps of n robots with a camera; holds no weights.

    Args:
        camera: what the images are of. It has to mark pixels without a return (``missing`` is ``"plane"``).
    """

    rays: Tensor
    eye: Tensor
    points: Tensor

    def __init__(self, camera: Camera) -> None:
        super().__init__()
        self.far = camera.far
        tan_x, tan_y = camera.tan_half
        across = (torch.arange(camera.width, device="cpu") + 0.5) / camera.width * 2 - 1
        down = (torch.arange(camera.height, device="cpu") + 0.5) / camera.height * 2 - 1
        v, u = torch.meshgrid(down * tan_y, across * tan_x, indexing="ij")
        turn = torch.tensor(camera.rotation(), dtype=torch.float32, device="cpu")
        rays = torch.stack([torch.ones_like(u), -u, -v], -1).reshape(-1, 3) @ turn.T
        quarters = torch.tensor(_QUARTERS, device="cpu") * (CELL / 2)
        middles = torch.tensor(POINTS, dtype=torch.float32, device="cpu")
        for name, numbers in (
            ("rays", rays.T.contiguous()),
            ("eye", torch.tensor(camera.position, dtype=torch.float32, device="cpu")),
            ("points", (middles[:, None] + quarters).reshape(-1, 2)),
        ):
            self.register_buffer(name, numbers, persistent=False)

    @staticmethod
    def start(n: int, device: torch.device | str | None = None) -> MapState:
        """Maps of n robots that have seen nothing."""
        unseen = torch.full((n, SIDE**2), UNSEEN, device=device)
        return MapState(torch.zeros(n, 3, device=device), unseen, torch.zeros(n, AGES, 13, device=device))

    @staticmethod
    def forget(state: MapState, fresh: Bool[Tensor, " n"]) -> MapState:
        """The maps, empty for those who begin anew."""
        pose, heights = torch.where(fresh[:, None], 0.0, state.pose), torch.where(fresh[:, None], UNSEEN, state.heights)
        return MapState(pose, heights, torch.where(fresh[:, None, None], 0.0, state.recent))

    def move(self, state: MapState, motion: Float[Tensor, "n 4"]) -> MapState:
        """After a control step.

        Args:
            state: before it.
            motion: of the trunk in it, as ``vinl.gait.proprioception.motion_of`` gives it [m, rad].
        """
        before = self._cell_of(state.pose[:, :2])
        half = state.pose[:, 2:] + 0.5 * motion[:, 3:]
        way = torch.cat(turned(half, motion[:, :1], motion[:, 1:2]), 1)
        pose = torch.cat([state.pose[:, :2] + way, state.pose[:, 2:] + motion[:, 3:]], 1)
        after = self._cell_of(pose[:, :2])
        heights = state.heights.reshape(-1, SIDE, SIDE)
        heights = torch.where(find_stale(before, after, SIDE), UNSEEN, heights)
        return MapState(pose, heights.reshape(-1, SIDE**2), state.recent)

    def see(
        self,
        state: MapState,
        image: Float[Tensor, "n height width"],
        axes: Float[Tensor, "n 3 3"],
        floor: Float[Tensor, " n"],
        age: Float[Tensor, " n"] | None = None,
    ) -> MapState:
        """With what an image shows, from where the robot was when it was taken; once in every control step.

        Args:
            state: before it.
            image: depth as a fraction of the camera's far limit; negative where nothing returned.
            axes: of the heading frame in the trunk's, now.
            floor: height of the floor under the legs in the heading frame [m], now.
            age: of the image [s]; None: it is of now.
        """
        now = torch.cat([state.pose, axes.flatten(1), floor[:, None]], 1)
        recent = torch.cat([now[:, None], state.recent[:, :-1]], 1)
        then = now if age is None else _stood(recent, age)
        pose, axes, floor = then[:, :3], then[:, 3:12].unflatten(1, (3, 3)), then[:, 12]
        depth = image.flatten(1).float()
        metres = depth * self.far
        points = [eye + ray * metres for eye, ray in zip(self.eye, self.rays, strict=True)]
        # part by part: axes times points all at once would be nine numbers a pixel
        sides = axes.permute(1, 2, 0)[..., None]
        ahead, left, up = (a * points[0] + b * points[1] + c * points[2] for a, b, c in sides)
        z = up - floor[:, None]
        known = (depth > 0) & (depth < 1) & (ahead < NEAR)
        z = z - _tilt(z, ahead, known)
        cells = self._index(pose, ahead, left)
        top = torch.full_like(state.heights, UNSEEN)
        top.scatter_reduce_(1, cells, torch.where(known, z, UNSEEN), "amax")
        rise = top - state.heights
        # a wall that leaves the image is cut off from above, to its foot: lower points do not make it lower, and what
        # looks like floor in its place wears it down
        lowered = (state.heights > WALL) & (rise < 0)
        share = torch.where(lowered, torch.where(top > _ROUGH, 0.0, _WEAR), _BLEND)
        share = torch.where(top > 0.5 * UNSEEN, share, 0.0)  # none where nothing was seen
        heights = torch.where(state.heights > 0.5 * UNSEEN, state.heights + share * rise, top)
        return MapState(state.pose, heights, recent)

    def read(self, state: MapState) -> Float[Tensor, "n 741"]:
        """Heights above the floor at the planner's points [m]; what was never seen is level floor.

        A cell of the planner is as high as three of its four quarters: by the highest one, every edge would lie up to
        half a cell farther out than it does, and a bar would be too deep to straddle. Where two were not seen, or a
        wall stands, the highest counts.
        """
        found = torch.gather(state.heights, 1, self._index(state.pose, *self.points.T))
        quarters = found.reshape(len(found), -1, len(_QUARTERS))
        highest = quarters.amax(-1)
        one, other = quarters[..., :2], quarters[..., 2:]
        lower = torch.maximum(one.amin(-1), other.amin(-1))
        third = torch.minimum(torch.minimum(one.amax(-1), other.amax(-1)), lower)
        height = torch.where((third < 0.5 * UNSEEN) | (highest > WALL), highest, third)
        return torch.where((height.abs() < _ROUGH) | (height < 0.5 * UNSEEN), 0.0, height)

    @staticmethod
    def _cell_of(xy: Tensor) -> Tensor:
        return torch.floor(xy / CELL)

    @classmethod
    def _index(
        cls, pose: Float[Tensor, "n 3"], x: Float[Tensor, "*n k"], y: Float[Tensor, "*n k"]
    ) -> Int[Tensor, "n k"]:
        """Of the cells at points of the heading frame."""
        column, row = (
            cls._cell_of(at[:, None] + away)
            for at, away in zip(pose[:, :2].unbind(1), turned(pose[:, 2:], x, y), strict=True)
        )
        # from a cell's middle: where a device rounds 112 / 112 to less than 1, a whole number would be cell 112 of 112
        column, row = (cell - SIDE * torch.floor((cell + 0.5) * _PER_SIDE) for cell in (column, row))
        return (column * SIDE + row).long()  # whole numbers below 2^24


def _stood(recent: Float[Tensor, "n ages 13"], age: Float[Tensor, " n"]) -> Float[Tensor, "n 13"]:
    """How the robots stood that long ago; those that had not begun stand as they do now."""
    steps = (age / CONTROL_DT).round().long().clamp(0, AGES - 1)
    then = recent.gather(1, steps[:, None, None].expand(-1, 1, recent.shape[2]))[:, 0]
    return torch.where((then == 0).all(1, keepdim=True), recent[:, 0], then)


def _tilt(z: Tensor, ahead: Tensor, known: Tensor) -> Tensor:
    """How high the floor seems to lie at each point: a plane through the points near it, tilted fore and aft. It takes
    out what the camera's mount, gravity's direction and the legs get wrong."""
    x = ahead - 0.7  # about the middle of what is seen
    found = torch.zeros_like(z)
    for _ in range(2):
        left = z - found
        w = (known & (left.abs() < _FLOOR)).float()
        n, wx, wxx = w.sum(1) + _SURE, (w * x).sum(1), (w * x * x).sum(1) + 0.1 * _SURE
        wz, wxz = (w * left).sum(1), (w * x * left).sum(1)
        scale = n * wxx - wx * wx
        level, slope = (wz * wxx - wx * wxz) / scale, (n * wxz - wx * wz) / scale
        found = found + level[:, None] + slope[:, None] * x
    return found
