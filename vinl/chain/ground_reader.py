"""The ground under each robot of a unit: every episode has its own grid, all are read in one look-up, for the gait of
policies that know the ground and for the height scan of environments."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from jaxtyping import Bool, Float

from vinl.gait.command import adapt_command
from vinl.gait.config import GaitConfig
from vinl.gait.footholds import plan_footholds
from vinl.gait.ground_view import FieldView, GroundMap, build_ground_map
from vinl.gait.observation import GAIT_ROWS
from vinl.gait.path import gait_rows
from vinl.gait.state import (
    GaitState,
    aim,
    feet_in_heading_frame,
    motion_between,
    start_gait,
    tick,
    velocity_in_heading_frame,
)
from vinl.robot.observation import SCAN_RADIUS
from vinl.sensing.height_scan import scan_ground
from vinl.world.boxes import Blocks, Boxes
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
    """Grids of n robots, or one for all, as one grid along y."""

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
    """Reads the height scan of robots in a floor plan. Walls and furniture stand as heights on the plan's grid; what
    hangs above the robot leaves the floor free.

    Level ground lies around them, as wide as robots look from where they are: none reads a neighbour's grid.
    """

    def __init__(self, plan: FloorPlan, blocks: Sequence[Blocks]) -> None:
        bare = flat_field(plan.frame.widen(int(np.ceil(SCAN_RADIUS / plan.frame.resolution)) + 1))
        raise_boxes(bare, plan.boxes.below(BODY_HEIGHT), WALL)
        fields = raise_blocks(bare, blocks)
        self._heights = np.concatenate([field.heights for field in fields]).ravel()
        self._stack = Stack(bare.frame, len(fields))

    def read(self, qpos: Float[np.ndarray, "n 19"]) -> Float[np.ndarray, "n points"]:
        """Height of the ground [m] under the scan points of every robot."""
        return scan_ground(np, self._heights, self._stack.frame, self._stack.place(qpos))


RIM = 2.0
"""Level ground around a plan [m]: no robot looks into the map of another episode."""

_SCALE = np.concatenate([np.repeat(row.scale, row.size) for row in GAIT_ROWS])


class GaitMaps:
    """Maps of the ground for n robots, stacked along y in one grid; one map serves all if they share the ground.

    Args:
        maps: one for each robot, or one for all, all on the same frame.
    """

    def __init__(self, maps: Sequence[GroundMap], frame: GridFrame) -> None:
        self.ground = GroundMap(*(np.concatenate(grids) for grids in zip(*maps, strict=True)))
        self._stack = Stack(frame, len(maps))

    def view(self, qpos: Float[np.ndarray, "n 19"]) -> FieldView:
        """The ground as each robot sees it."""
        return FieldView(np, self.ground, self._stack.frame, self._stack.place(qpos[:, :7]))


def map_plan(plan: FloorPlan, blocks: Sequence[Blocks]) -> GaitMaps:
    """Maps of a floor plan with the clutter of each episode."""
    fields = raise_blocks(flat_field(plan.frame.widen(round(RIM / plan.frame.resolution))), blocks)
    maps = [
        build_ground_map(field.heights, field.frame, plan.boxes.below(BODY_HEIGHT) + some.boxes())
        for field, some in zip(fields, blocks, strict=False)
    ]
    return GaitMaps(maps, fields[0].frame)


def map_ground(heights: Float[np.ndarray, "rows columns"], frame: GridFrame, boxes: Boxes) -> GaitMaps:
    """One map for all robots: heights of ground and blocks without walls [m], and all boxes that stand on it."""
    return GaitMaps([build_ground_map(heights, frame, boxes)], frame)


class GaitReader:
    """Keeps the gaits of n robots, one control step after the other.

    Attributes:
        gait: of all robots, as of the last ``read``; None before the first.
    """

    def __init__(self, config: GaitConfig, maps: GaitMaps) -> None:
        self.config, self._maps = config, maps
        self.gait: GaitState | None = None
        self._last = np.zeros((0, 19))
        self._fresh = np.zeros(0, bool)

    def reset(self, which: Bool[np.ndarray, " n"]) -> None:
        """These robots start anew with the next ``read``."""
        if len(self._fresh):
            self._fresh |= which

    def take_over(self, before: GaitReader) -> None:
        """Go on with the gaits of the same robots on another map."""
        self.gait, self._last, self._fresh = before.gait, before._last, before._fresh

    def read(
        self, qpos: Float[np.ndarray, "n 19"], qvel: Float[np.ndarray, "n 18"], command: Float[np.ndarray, "n 3"]
    ) -> tuple[Float[np.ndarray, "n 3"], Float[np.ndarray, "n 63"]]:
        """One control step on: the command that robots walk by, see ``adapt_command``, and the rows of the gait,
        scaled, in the order of ``GAIT_ROWS``."""
        view, feet = self._maps.view(qpos), feet_in_heading_frame(np, qpos)
        command = adapt_command(np, self.config, view, command, feet)
        start = start_gait(np, self.config, feet)
        if self.gait is None or len(self._last) != len(qpos):
            gait, motion = start, np.zeros((len(qpos), 4))
        else:
            gait = GaitState(
                *(
                    np.where(self._fresh.reshape(-1, *(1,) * (new.ndim - 1)), new, old)
                    for new, old in zip(start, self.gait, strict=True)
                )
            )
            motion = np.where(self._fresh[:, None], 0.0, motion_between(np, self._last, qpos))
        self._last, self._fresh = qpos.copy(), np.zeros(len(qpos), bool)
        gait = tick(np, self.config, gait, motion, command, feet)
        velocity = velocity_in_heading_frame(np, qpos, qvel)
        plan = plan_footholds(np, self.config, view, gait, velocity, command, feet)
        self.gait = aim(np, self.config, gait, plan, velocity, command, feet)
        return command, gait_rows(np, self.config, self.gait, feet, np.zeros(len(qpos))) * _SCALE
