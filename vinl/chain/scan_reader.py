"""The ground under each robot of a unit: every episode has its own grid, all are read in one look-up."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from vinl.robot.observation import SCAN_RADIUS
from vinl.sensing.detour import DetourConfig, bend_command, keep_out
from vinl.sensing.height_scan import scan_ground
from vinl.world.boxes import Blocks
from vinl.world.floorplan import BODY_HEIGHT, FloorPlan
from vinl.world.grid import BLOCK, WALL, GridFrame, HeightField, flat_field, raise_boxes


def raise_blocks(bare: HeightField, blocks: Sequence[Blocks]) -> list[HeightField]:
    """The ground of each episode with its blocks; one for all where no episode has any."""
    if not any(len(some) for some in blocks):
        return [bare]
    fields = [HeightField(bare.heights.copy(), bare.labels.copy(), bare.frame) for _ in blocks]
    for field, some in zip(fields, blocks, strict=True):
        raise_boxes(field, some.boxes(), BLOCK)
    return fields


class Stack:
    """Grids of n robots, or one for all, as one grid along y.

    Args:
        frame: of each.
        count: of grids.

    Attributes:
        frame: of all together.
    """

    def __init__(self, frame: GridFrame, count: int) -> None:
        rows, columns = frame.shape
        self.frame = GridFrame(frame.x0, frame.y0, frame.resolution, (count * rows, columns))
        self._shift = np.arange(count) * rows * frame.resolution

    def place(self, qpos: Float[np.ndarray, "n k"]) -> Float[np.ndarray, "n k"]:
        """Poses moved to where each robot's own grid lies."""
        at = qpos.copy()
        at[:, 1] += self._shift
        return at


class ScanReader:
    """Reads the height scan of all robots of a unit.

    Args:
        fields: one for each robot, or one for all.
        detour: how commands are bent; None: not at all.
    """

    def __init__(self, fields: Sequence[HeightField], detour: DetourConfig | None = None) -> None:
        self._heights = np.concatenate([field.heights for field in fields]).ravel()
        self._stack = Stack(fields[0].frame, len(fields))
        self._detour = None
        if detour is not None:
            closed = np.concatenate([keep_out(field, detour.margin) for field in fields]).ravel()
            self._detour = closed, detour

    @classmethod
    def on_plan(cls, plan: FloorPlan, blocks: Sequence[Blocks], detour: DetourConfig | None = None) -> ScanReader:
        """Of robots in a floor plan, each with its own blocks. Walls and furniture stand as heights on the plan's grid;
        what hangs above the robot leaves the floor free.

        Level ground lies around them, as wide as robots look from where they are: none reads a neighbour's grid.
        """
        reach = max(SCAN_RADIUS, 0.0 if detour is None else detour.reach)
        field = flat_field(plan.frame.widen(int(np.ceil(reach / plan.frame.resolution)) + 1))
        raise_boxes(field, plan.boxes.below(BODY_HEIGHT), WALL)
        return cls(raise_blocks(field, blocks), detour)

    def read(self, qpos: Float[np.ndarray, "n 19"]) -> Float[np.ndarray, "n points"]:
        """Height of the ground [m] under the scan points of every robot."""
        return scan_ground(np, self._heights, self._stack.frame, self._stack.place(qpos))

    def bend(self, qpos: Float[np.ndarray, "n 19"], command: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 3"]:
        """The commands as the locomotor is given them: with detours, if it was trained with such."""
        if self._detour is None:
            return command
        closed, config = self._detour
        return bend_command(np, closed, self._stack.frame, self._stack.place(qpos), command, config)
