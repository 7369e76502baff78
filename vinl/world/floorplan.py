"""Floor plans: walls, furniture and free floor, whatever file they came from."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Bool, Float
from scipy.ndimage import distance_transform_edt

from vinl.config.errors import InputError
from vinl.world.boxes import FARTHEST, Boxes
from vinl.world.grid import GridFrame
from vinl.world.raster import paint_boxes

RESOLUTION = 0.05
"""Side of a grid cell of every floor plan [m]."""

BODY_HEIGHT = 0.6
"""What begins above this height does not take floor from the robot [m]: paintings, wall cupboards, door lintels."""

MARGIN = 0.5
"""Strip of outside that the grid keeps around the building [m]."""

MAX_CELLS = 9_000_000
"""More cells than this (a square of 150 m) is taken for a wrong scale."""

LONGEST = 400.0
"""So is a plan that is longer than this [m], however narrow."""


ROOM_TO_STAND = 0.4
"""Half the robot's diagonal [m]: a spot with this clearance lets it stand and turn (0.70 m x 0.38 m)."""


def measure_clearance(free: Bool[np.ndarray, "rows columns"], resolution: float) -> Float[np.ndarray, "rows columns"]:
    """Distance [m] from each cell's centre to the edge of the nearest cell that is not free; 0 where not free."""
    padded = np.pad(free, 1)
    cells = np.asarray(distance_transform_edt(padded))[1:-1, 1:-1]
    return np.maximum((cells - 0.5) * resolution, 0.0).astype(np.float32)


@dataclass(frozen=True)
class RoomLabel:
    """A room's name and where to write it [m]."""

    name: str
    x: float
    y: float


@dataclass(frozen=True, eq=False)
class FloorPlan:
    """One storey of a building.

    Attributes:
        name: short name, for tables and pictures.
        source: the file it came from, with ``:index`` where the file holds several.
        walls: upright boxes; a lintel over a door is a box whose bottom is above the floor.
        furniture: upright boxes.
        inside: shape (rows, columns), the floor of the building; cells under walls and furniture may be either.
        free: shape (rows, columns), floor inside that nothing below ``BODY_HEIGHT`` covers.
        frame: where the cells of both grids lie.
        windows: panes, and front doors (those from the floor on, bottom 0); only drawn, since a pane or a shut door
            stops robot and depth camera like the wall does.
        labels: room names; only drawn.
    """

    name: str
    source: str
    walls: Boxes
    furniture: Boxes
    inside: Bool[np.ndarray, "rows columns"]
    free: Bool[np.ndarray, "rows columns"]
    frame: GridFrame
    windows: Boxes = field(default_factory=Boxes.empty)
    labels: tuple[RoomLabel, ...] = ()

    def __repr__(self) -> str:
        return (
            f"FloorPlan({self.name}: {self.area_m2:.0f} m2 free, {len(self.walls)} boxes of walls, "
            f"{len(self.furniture)} of furniture, {len(self.labels)} rooms)"
        )

    def _repr_png_(self) -> bytes:
        """A picture from above, for notebooks."""
        from vinl.world.drawing import encode_floorplan  # it draws plans, so it has to know this class first

        return encode_floorplan(self)

    @property
    def area_m2(self) -> float:
        """Free floor [m2]."""
        return float(self.free.sum()) * self.frame.resolution**2

    @property
    def boxes(self) -> Boxes:
        """Walls, then furniture."""
        return self.walls + self.furniture


def frame_around(
    low: Float[np.ndarray, " 2"], high: Float[np.ndarray, " 2"], source: str, resolution: float = RESOLUTION
) -> GridFrame:
    """A grid frame that holds the rectangle from ``low`` to ``high`` [m] and ``MARGIN`` around it. Raises
    ``InputError`` if the plan would be beyond all reason large."""
    low, high = np.asarray(low), np.asarray(high)
    if not (np.maximum(np.abs(low), np.abs(high)) <= FARTHEST).all():
        raise InputError(
            f"{source}: the plan reaches farther than {FARTHEST:g} m from its origin; check its scale and its numbers"
        )
    first = np.floor((low - MARGIN) / resolution)
    cells = np.ceil((high + MARGIN) / resolution) - first
    size = high - low
    if cells.prod() > MAX_CELLS or size.max() > LONGEST:
        most = f"a square of {np.sqrt(MAX_CELLS) * resolution:.0f} m, or {LONGEST:g} m in length"
        raise InputError(
            f"{source}: the plan would be {size[0]:.4g} m x {size[1]:.4g} m, more than {most}; check its scale (metres "
            "per pixel)"
        )
    x0, y0 = (first + 0.5) * resolution
    return GridFrame(float(x0), float(y0), resolution, (int(cells[1]), int(cells[0])))


def assemble_floorplan(
    name: str,
    source: str,
    walls: Boxes,
    furniture: Boxes,
    inside: Bool[np.ndarray, "rows columns"],
    frame: GridFrame,
    windows: Boxes | None = None,
    labels: tuple[RoomLabel, ...] = (),
    roomy: bool = False,
) -> FloorPlan:
    """Work out the free floor, cut the grid to the building and refuse what no robot can stand in. With ``roomy``, it
    is known that the robot has room, which saves the time to measure it. Raises ``InputError`` if nothing is inside,
    nothing is free, or the widest free spot is too small for the robot."""
    if not inside.any():
        raise InputError(
            f"{source}: no floor is enclosed by walls; close the outer walls, or check which pixels are walls"
        )
    rows, columns = np.flatnonzero(inside.any(1)), np.flatnonzero(inside.any(0))
    pad = round(MARGIN / frame.resolution)
    top, bottom = max(rows[0] - pad, 0), min(rows[-1] + pad + 1, frame.shape[0])
    left, right = max(columns[0] - pad, 0), min(columns[-1] + pad + 1, frame.shape[1])
    x0, y0 = frame.xy(np.array([top, left]))
    inside = inside[top:bottom, left:right]
    frame = GridFrame(float(x0), float(y0), frame.resolution, (inside.shape[0], inside.shape[1]))
    walls, furniture = _keep_near(walls, frame), _keep_near(furniture, frame)
    free = inside & ~paint_boxes((walls + furniture).below(BODY_HEIGHT), frame)
    if not free.any():
        raise InputError(f"{source}: walls and furniture cover the whole plan; check which pixels are walls")
    if not roomy and (widest := 2 * float(measure_clearance(free, frame.resolution).max())) < 2 * ROOM_TO_STAND:
        raise InputError(
            f"{source}: the plan is too small for the robot: its widest free spot is {widest:.2f} m, the robot needs "
            f"{2 * ROOM_TO_STAND:.2f} m; check the scale (metres per pixel)"
        )
    return FloorPlan(name, source, walls, furniture, inside, free, frame, windows or Boxes.empty(), labels)


def _keep_near(boxes: Boxes, frame: GridFrame) -> Boxes:
    """Drop the boxes that lie wholly off the grid."""
    if not len(boxes):
        return boxes
    corners = boxes.corners()
    x, y = frame.centres()
    half = frame.resolution / 2
    near = (corners[..., 0].max(1) > x[0] - half) & (corners[..., 0].min(1) < x[-1] + half)
    near &= (corners[..., 1].max(1) > y[0] - half) & (corners[..., 1].min(1) < y[-1] + half)
    return Boxes(boxes.rows[near])
