"""A map that a navigation policy keeps of its own: where it has been, by its own motion, and where its depth camera saw
something solid. Plain tensor operations without weights, so that the map is part of the policy's memory: training,
evaluation and export carry it along like the state of an LSTM."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import Any

import torch
from jaxtyping import Bool, Float
from torch import Tensor

from vinl.policies.places import CELLS, FADE, VIEW, mark_places, view_places

PLANES = 2
"""Where it has been, and what is solid."""

MAP_SIZE = PLANES * VIEW**2
"""Numbers that the network sees of the map."""

STATE_SIZE = 3 + PLANES * CELLS**2
"""Numbers that the map is kept in: x, y [m] and yaw [rad] since the start of the episode, then the planes."""

_SOLID = (0.2, 1.0)
"""What the camera sees between these heights above the floor is solid [m]: not blocks, which the legs step over."""

_NEAR_ENOUGH = 4.0
"""Farther away a tilt of the trunk lifts the floor into this band [m]."""

_STRIDE = 4
"""Every so many pixels of every so many rows are looked at."""


@dataclass(frozen=True)
class MapGeometry:
    """What motion and image mean in metres.

    Attributes:
        min_speed, max_speed: forward speed at -1 and 1 [m/s].
        max_yaw_rate: yaw rate at 1 [rad/s].
        period: of a step [s].
        hfov, pitch_down: of the camera [rad].
        far: depth at 1 in the image [m].
        forward, height: of the camera, ahead of the robot's middle and above the floor [m].
    """

    min_speed: float
    max_speed: float
    max_yaw_rate: float
    period: float
    hfov: float
    pitch_down: float
    far: float
    forward: float
    height: float

    def describe(self) -> dict[str, Any]:
        """The record as plain data, for policy cards."""
        return asdict(self)


def blank_map(n: int, device: torch.device | str | None = None) -> Float[Tensor, "n state"]:
    """The maps of n robots that have been nowhere."""
    return torch.zeros(n, STATE_SIZE, device=device)


@torch.no_grad()
def update_map(
    state: Float[Tensor, "n state"],
    motion: Float[Tensor, "n 2"],
    depth: Float[Tensor, "n height width"] | None,
    fresh: Bool[Tensor, " n"],
    geometry: MapGeometry,
) -> tuple[Float[Tensor, "n view"], Float[Tensor, "n state"]]:
    """The maps after a step.

    Args:
        motion: of the step that led here, in units of the action; of a fresh episode it is not read.
        depth: in [0, 1], what is not above 0 did not return; None: blind.
        fresh: an episode begins: its map is blank.

    Returns:
        What the network sees, (n, ``MAP_SIZE``): around the robot, in its heading frame, where it has been and what is
        solid; and the state.
    """
    g = geometry
    motion = torch.where(fresh[:, None], 0.0, motion.float())
    speed = torch.where(fresh, 0.0, g.min_speed + 0.5 * (motion[:, 0] + 1.0) * (g.max_speed - g.min_speed))
    turn = g.max_yaw_rate * g.period * motion[:, 1]
    state = torch.where(fresh[:, None], 0.0, state)
    yaw = state[:, 2] + 0.5 * turn
    way = g.period * speed
    position = state[:, :2] + torch.stack([way * yaw.cos(), way * yaw.sin()], 1)
    yaw = state[:, 2] + turn
    visited, solid = (FADE * plane for plane in state[:, 3:].chunk(PLANES, 1))
    here = torch.ones_like(yaw, dtype=torch.bool)[:, None]
    visited = mark_places(visited, position[:, None], here)
    if depth is not None:
        points, hit = _find_solid(depth, g)
        c, s = yaw.cos()[:, None], yaw.sin()[:, None]
        x, y = points.unbind(-1)
        solid = mark_places(solid, torch.stack([c * x - s * y, s * x + c * y], -1) + position[:, None], hit)
    seen = torch.cat([view_places(visited, position, yaw), view_places(solid, position, yaw)], 1)
    return seen, torch.cat([position, yaw[:, None], visited, solid], 1)


def _find_solid(depth: Tensor, g: MapGeometry) -> tuple[Float[Tensor, "n k 2"], Bool[Tensor, "n k"]]:
    """Points ahead and to the left of the robots [m], and which of them are solid."""
    height, width = depth.shape[1:]
    rows = torch.arange(_STRIDE // 2, height, _STRIDE, device=depth.device)
    columns = torch.arange(_STRIDE // 2, width, _STRIDE, device=depth.device)
    z = g.far * depth[:, rows][:, :, columns].float()
    tan = math.tan(g.hfov / 2)
    left = tan * (1.0 - (2.0 * columns + 1.0) / width)
    up = tan * height / width * (1.0 - (2.0 * rows + 1.0) / height)[:, None]
    sine, cosine = math.sin(g.pitch_down), math.cos(g.pitch_down)
    ahead, above = z * (cosine + sine * up) + g.forward, z * (cosine * up - sine) + g.height
    hit = (z > 0.0) & (z < _NEAR_ENOUGH) & (above > _SOLID[0]) & (above < _SOLID[1])
    return torch.stack([ahead, z * left], -1).flatten(1, 2), hit.flatten(1)
