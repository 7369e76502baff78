"""Where the robot can be: free floor eroded by its footprint, clearance, connected regions."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Bool, Float, Int

from vinl.config.errors import InputError
from vinl.world.floorplan import FloorPlan, measure_clearance
from vinl.world.raster import label_regions

FOOTPRINT_RADIUS = 0.22
"""Radius that the floor is eroded by [m]: AlienGo's agent radius in the paper's navigator
[paper, IV; habitat-lab, branch vinl]."""

FIT_RADIUS = 0.27
"""Radius for which the robot walks through a gap without touching its sides [m]: half its width over the legs (0.38 m),
and 8 cm for sway and steering at 2 Hz. On a grid of 5 cm a doorway of 0.6 m still counts, one of 0.5 m does not."""


@dataclass(frozen=True, eq=False)
class FreeSpace:
    """The part of a floor plan where the middle of the robot may be.

    Attributes:
        plan: the floor plan.
        radius: footprint radius that the free floor is eroded by [m].
        clearance: shape (rows, columns), distance to the nearest wall, furniture or outside [m].
        traversable: shape (rows, columns), clearance of at least ``radius``.
        regions: shape (rows, columns), number of the connected region from 1 on, 0 where not traversable. Cells join
            over edges only, so that two regions never touch.
        largest: number of the region with most cells.

    Raises:
        InputError: if the robot fits nowhere.
    """

    plan: FloorPlan
    radius: float = FOOTPRINT_RADIUS
    clearance: Float[np.ndarray, "rows columns"] = field(init=False)
    traversable: Bool[np.ndarray, "rows columns"] = field(init=False)
    regions: Int[np.ndarray, "rows columns"] = field(init=False)
    largest: int = field(init=False)

    def __post_init__(self) -> None:
        clearance = measure_clearance(self.plan.free, self.plan.frame.resolution)
        traversable = clearance >= self.radius
        if not traversable.any():
            raise InputError(
                f"{self.plan.source}: the plan is too small for the robot (radius {self.radius:.2f} m); check its scale"
            )
        regions = label_regions(traversable)
        sizes = np.bincount(regions.ravel())
        sizes[0] = 0
        for name, value in (("clearance", clearance), ("traversable", traversable), ("regions", regions)):
            object.__setattr__(self, name, value)
        object.__setattr__(self, "largest", int(sizes.argmax()))
