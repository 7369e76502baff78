"""What the robot of a live session walks in: a home, or open ground with blocks."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from vinl.chain.config import EvaluationConfig
from vinl.chain.episode import draw_routes, draw_setup
from vinl.config.errors import InputError
from vinl.config.loader import closest
from vinl.courses.crossing import WIDTH
from vinl.courses.grounds import DENSITY, GroundConfig, build_ground
from vinl.robot.aliengo import DEFAULT_POSE, KD, KP, LENGTH
from vinl.world.boxes import Blocks, Boxes
from vinl.world.clutter import CLUTTER, choose_clutter, scatter_blocks
from vinl.world.floorplan import FloorPlan
from vinl.world.grid import GridFrame

OPEN_GROUNDS = ("flat", "blocks", "litter", "bars")
"""Open grounds by name: level floor, blocks, litter, and a lane with bars across it that get higher."""

TOO_CLOSE = LENGTH / 2 + 0.1
"""No block is put down with any part nearer to the robot's middle than this [m]."""

_FENCE = 0.4
"""Height of the fence around open ground [m]."""

_BARS = (0.05, 0.10, 0.15, 0.20)
"""Heights of the bars [m], ``_BAR_EVERY`` apart, the first one so far from the start [m]; ``_BAR_DEPTH`` deep."""

_BAR_EVERY, _BAR_DEPTH = 1.5, 0.2


@dataclass(frozen=True, eq=False)
class World:
    """A floor plan with its clutter, and where the robot starts: x, y [m], yaw [rad], and its joint angles [rad]."""

    plan: FloorPlan
    blocks: Blocks
    start: Float[np.ndarray, "3"]
    joints: Float[np.ndarray, "12"]

    def with_blocks(self, blocks: Blocks) -> World:
        """The same world with other clutter."""
        return replace(self, blocks=blocks)

    def with_block(self, block: Blocks, robot: Float[np.ndarray, "2"]) -> World:
        """One more block. Raises ``InputError`` if it would lie on the robot, whose middle is at ``robot`` [m]."""
        if block.boxes().distances(robot[None]).min() < TOO_CLOSE:
            raise InputError("no block fits there: the robot is in the way")
        return self.with_blocks(self.blocks + block)

    def without_block(self, xy: Float[np.ndarray, "2"]) -> World | None:
        """Without the blocks that lie at a point [m]; None if none does."""
        if not len(self.blocks):
            return None
        hit = self.blocks.boxes().contain(xy[None])[:, 0]
        return self.with_blocks(Blocks(self.blocks.rows[~hit])) if hit.any() else None

    def scattered(self, preset: str, rng: np.random.Generator, robot: Float[np.ndarray, "2"]) -> World:
        """With clutter drawn anew, none of it near the robot, whose middle is at ``robot`` [m]."""
        return self.with_blocks(scatter_blocks(self.plan, choose_clutter(preset), rng, robot[None]))


def draw_block(xy: Float[np.ndarray, "2"], rng: np.random.Generator) -> Blocks:
    """One block at a point [m], of a size as in the paper's clutter and with any yaw."""
    preset = CLUTTER["paper"]
    row = [*xy, rng.uniform(-np.pi, np.pi), rng.uniform(*preset.length), preset.width, rng.uniform(*preset.height)]
    return Blocks(np.array([row]))


def open_home(plan: FloorPlan, obstacles: str, seed: int, config: EvaluationConfig) -> World:
    """A home, with robot and clutter as in its first episode with this seed. Raises ``InputError`` if the preset is
    unknown, or the plan has no room."""
    preset = choose_clutter(obstacles)
    setup = draw_setup(plan, draw_routes(plan, 1, config)[0], 0, seed, preset, config)
    return World(plan, setup.blocks, np.array([*setup.route.start, setup.yaw]), setup.joints)


def open_ground(terrain: str, seed: int, density: float | None = None) -> World:
    """One of ``OPEN_GROUNDS``, such as ``vinl eval-loco`` tries a locomotion policy on, with a fence around it;
    ``density`` is in blocks per m2, by default 1, or objects of litter per m2, by default 10. Raises ``InputError`` if
    there is no such ground."""
    if terrain not in OPEN_GROUNDS:
        known = ", ".join(OPEN_GROUNDS)
        raise InputError(f"--terrain {terrain!r} cannot be played{closest(terrain, OPEN_GROUNDS)}; known: {known}")
    if terrain == "bars":
        return _open_lane()
    chosen = DENSITY.get(terrain, 1.0) if density is None else density
    ground = build_ground(GroundConfig(terrain, chosen, None, seed, KP, KD))
    x, y = ground.homes[0, :2]
    start = np.array([x, y, 0.0])
    keep = np.ones(len(ground.blocks), bool)
    if len(ground.blocks):
        keep = ground.blocks.boxes().distances(start[None, :2])[:, 0] >= TOO_CLOSE
    return World(_fence_in(terrain, ground.field.frame), Blocks(ground.blocks.rows[keep]), start, DEFAULT_POSE.copy())


def _open_lane() -> World:
    """A lane as wide as the corridor of the test over bars, which the bars span."""
    length, r = _BAR_EVERY * (len(_BARS) + 2), 0.05
    frame = GridFrame(-_BAR_EVERY, -WIDTH / 2 - r, r, (round(WIDTH / r) + 3, round(length / r) + 1))
    bars = [[_BAR_EVERY * (k + 1), 0.0, np.pi / 2, WIDTH, _BAR_DEPTH, height] for k, height in enumerate(_BARS)]
    return World(_fence_in("bars", frame), Blocks(np.array(bars)), np.zeros(3), DEFAULT_POSE.copy())


def _fence_in(name: str, frame: GridFrame) -> FloorPlan:
    """A grid without anything but a fence along its rim as a floor plan."""
    low, high = frame.xy(np.zeros(2, int)), frame.xy(np.array(frame.shape) - 1)
    (cx, cy), (sx, sy), t = (low + high) / 2, high - low, frame.resolution
    rows = [[cx, y, 0.0, sx, t, 0.0, _FENCE] for y in (low[1], high[1])]
    rows += [[x, cy, 0.0, t, sy, 0.0, _FENCE] for x in (low[0], high[0])]
    inside = np.ones(frame.shape, bool)
    free = np.pad(inside[1:-1, 1:-1], 1)
    return FloorPlan(name, name, Boxes(np.array(rows)), Boxes.empty(), inside, free, frame)
