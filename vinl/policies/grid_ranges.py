"""Distances from a robot to what its occupancy grid holds, all around: what a lidar would measure, also beside and
behind, where no camera looks."""

from __future__ import annotations

import math

import torch
from jaxtyping import Float
from torch import Tensor

from vinl.policies.occupancy_grid import OCCUPIED, GridState, index_of, known_cells
from vinl.policies.rolling_cells import turned

DIRECTIONS = 24
"""Rays, from straight ahead on to the left."""

_REACH, _STEP = 3.0, 0.1
"""Length of a ray, and the distance of the points on it that are looked at [m]."""


def measure_ranges(state: GridState) -> Float[Tensor, "n directions"]:
    """Distances to the nearest occupied cells, as fractions of 3 m; what is unknown is free."""
    pose = state.pose[0]
    angle = torch.arange(DIRECTIONS, device=pose.device) * (2 * math.pi / DIRECTIONS)
    along = (torch.arange(round(_REACH / _STEP), device=pose.device) + 1) * _STEP
    ahead, left = ((part[:, None] * along).flatten()[None] for part in (angle.cos(), angle.sin()))
    x, y = turned(pose[:, 2:], ahead, left)
    index = index_of(x + pose[:, :1], y + pose[:, 1:2])
    held = (known_cells(state).gather(1, index) > OCCUPIED).unflatten(1, (DIRECTIONS, len(along)))
    return torch.where(held, along / _REACH, 1.0).amin(2)
