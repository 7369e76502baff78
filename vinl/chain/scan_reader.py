"""The ground under each robot of a unit: every episode has its own grid, all are read in one look-up."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from vinl.robot.observation import SCAN_RADIUS
from vinl.sensing.detour import DetourConfig, bend_command, keep_out
from vinl.sensing.height_scan import scan_ground
from vinl.world.blocks import Blocks
from vinl.world.floorplan import BODY_HEIGHT, FloorPlan
from vinl.world.grid import GridFrame
from vinl.world.heightfield import BLOCK, WALL, HeightField, flat_field, raise_boxes


def rasterise_plan(plan: FloorPlan, reach: float = SCAN_RADIUS) -> HeightField:
    """Walls and furniture as heights on the plan's grid; what hangs above the robot leaves the floor free.

    Level ground lies around them, as wide as robots look from where they are [m]: none reads a neighbour's grid.
    """
    rim = int(np.ceil(reach / plan.frame.resolution)) + 1
    shape = (plan.frame.shape[0] + 2 * rim, plan.frame.shape[1] + 2 * rim)
    r = plan.frame.resolution
    field = flat_field(GridFrame(plan.frame.x0 - rim * r, plan.frame.y0 - rim * r, r, shape))
    boxes = plan.boxes
    if len(boxes):
        raise_boxes(field, boxes[boxes.rows[:, 5] < BODY_HEIGHT], WALL)
    return field


class ScanReader:
    """Reads the height scan of all robots of a unit.

    The grids of the episodes are stacked along y; the look-up of robot k is moved to grid k. Episodes without blocks
    share one grid.

    Args:
        plan: walls and furniture.
        blocks: of each episode.
        detour: how commands are bent; None: not at all.
    """

    def __init__(
        self,
        plan: FloorPlan,
        blocks: Sequence[Blocks],
        detour: DetourConfig | None = None,
    ) -> None:
        bare = rasterise_plan(plan, max(SCAN_RADIUS, 0.0 if detour is None else detour.reach))
        if not any(len(b) for b in blocks):
            self._stack([bare], detour)
            return
        fields = [HeightField(bare.heights.copy(), bare.labels.copy(), bare.frame) for _ in blocks]
        for field, some in zip(fields, blocks, strict=True):
            raise_boxes(field, some.boxes(), BLOCK)
        self._stack(fields, detour)

    def _stack(self, fields: Sequence[HeightField], detour: DetourConfig | None) -> None:
        """One field for each robot, or one for all."""
        frame = fields[0].frame
        rows, columns = frame.shape
        self._heights = np.concatenate([field.heights for field in fields]).ravel()
        self._frame = GridFrame(frame.x0, frame.y0, frame.resolution, (len(fields) * rows, columns))
        self._shift = np.arange(len(fields)) * rows * frame.resolution
        self._detour = None
        if detour is not None:
            closed = np.concatenate([keep_out(field, detour.margin) for field in fields]).ravel()
            self._detour = closed, detour

    def read(self, qpos: Float[np.ndarray, "n 19"]) -> Float[np.ndarray, "n points"]:
        """Height of the ground [m] under the scan points of every robot."""
        return scan_ground(np, self._heights, self._frame, self._on_grid(qpos))

    def bend(self, qpos: Float[np.ndarray, "n 19"], command: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 3"]:
        """The commands as the locomotor is given them: with detours, if it was trained with such."""
        if self._detour is None:
            return command
        closed, config = self._detour
        return bend_command(np, closed, self._frame, self._on_grid(qpos), command, config)

    def _on_grid(self, qpos: Float[np.ndarray, "n 19"]) -> Float[np.ndarray, "n 19"]:
        at = qpos.copy()
        at[:, 1] += self._shift
        return at
