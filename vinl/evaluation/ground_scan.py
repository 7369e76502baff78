"""The ground under each robot of a unit: every episode has its own grid, all are read in one look-up."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from vinl.robot.observation import STANDARD_SCAN, HeightScan
from vinl.sensing.height_scan import scan_ground
from vinl.world.blocks import Blocks
from vinl.world.floorplan import BODY_HEIGHT, FloorPlan
from vinl.world.grid import GridFrame
from vinl.world.heightfield import BLOCK, WALL, HeightField, flat_field, raise_boxes


def rasterise_plan(plan: FloorPlan, scan: HeightScan = STANDARD_SCAN) -> HeightField:
    """Walls and furniture as heights on the plan's grid; what hangs above the robot leaves the floor free.

    Level ground lies around them, as wide as the scan reaches: none reads a neighbour's grid.
    """
    rim = int(np.ceil(scan.reach / plan.frame.resolution)) + 1
    shape = (plan.frame.shape[0] + 2 * rim, plan.frame.shape[1] + 2 * rim)
    r = plan.frame.resolution
    field = flat_field(GridFrame(plan.frame.x0 - rim * r, plan.frame.y0 - rim * r, r, shape))
    boxes = plan.boxes
    if len(boxes):
        raise_boxes(field, boxes[boxes.rows[:, 5] < BODY_HEIGHT], WALL)
    return field


class GroundScan:
    """Reads the height scan of all robots of a unit.

    The grids of the episodes are stacked along y; the look-up of robot k is moved to grid k. Episodes without blocks
    share one grid.

    Args:
        plan: walls and furniture.
        blocks: of each episode.
        scan: where to read.
    """

    def __init__(self, plan: FloorPlan, blocks: Sequence[Blocks], scan: HeightScan = STANDARD_SCAN) -> None:
        self._scan = scan
        bare = rasterise_plan(plan, scan)
        rows, columns = bare.frame.shape
        if any(len(b) for b in blocks):
            heights = np.empty((len(blocks), rows, columns), np.float32)
            for k, some in enumerate(blocks):
                field = HeightField(bare.heights.copy(), bare.labels.copy(), bare.frame)
                raise_boxes(field, some.boxes(), BLOCK)
                heights[k] = field.heights
            self._shift = np.arange(len(blocks)) * rows * bare.frame.resolution
        else:
            heights, self._shift = bare.heights[None], np.zeros(len(blocks))
        self._heights = heights.ravel()
        self._frame = GridFrame(bare.frame.x0, bare.frame.y0, bare.frame.resolution, (len(heights) * rows, columns))

    def read(self, qpos: Float[np.ndarray, "n 19"]) -> Float[np.ndarray, "n points"]:
        """Height of the ground [m] under the scan points of every robot."""
        at = qpos.copy()
        at[:, 1] += self._shift
        return scan_ground(np, self._heights, self._frame, at, self._scan)
