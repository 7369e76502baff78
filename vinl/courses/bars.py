"""A corridor with a bar across it: there is no way around."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vinl.chain.scene import build_scene
from vinl.config.errors import InputError
from vinl.courses.courses import Start
from vinl.courses.grounds import Ground
from vinl.robot.aliengo import DEFAULT_POSE
from vinl.world.boxes import Blocks, Boxes
from vinl.world.grid import BLOCK, WALL, GridFrame, flat_field, raise_boxes

WIDTH = 1.0
"""Between the walls of the corridor [m]. The bar spans it."""

APPROACH, SPREAD = 1.4, 0.6
"""The trunk starts so far before the bar [m], and up to ``SPREAD`` farther: a stride or more, so that the bar is met in
every phase of the gait."""

BEYOND = 1.0
"""The trunk is across so far behind the bar [m]: the rear feet are then half a metre past it."""

_ASIDE, _ASKEW, _JOINTS = 0.05, 0.1, 0.05
_MARGIN = 1.5
_WALL_THICKNESS, _WALL_HEIGHT = 0.1, 2.5
_RESOLUTION = 0.05
_GOLDEN = 0.6180339887498949


@dataclass(frozen=True)
class BarConfig:
    """Which bar, and how it is approached.

    Attributes:
        height: of the bar [m].
        depth: of the bar along the corridor [m].
        speed: commanded forward speed [m/s].
        seed: of the starts.
        kp, kd: gains of the joints.

    Raises:
        InputError: a number is out of range.
    """

    height: float
    depth: float
    speed: float
    seed: int
    kp: float
    kd: float

    def __post_init__(self) -> None:
        for name, value, low, high, unit in (
            ("height", self.height, 0.01, 0.5, "m"),
            ("depth", self.depth, 0.02, 1.0, "m"),
            ("speed", self.speed, 0.1, 1.5, "m/s"),
        ):
            if not low <= value <= high:
                raise InputError(f"--{name} must lie between {low:g} and {high:g} {unit}, got {value:g}")

    @property
    def end(self) -> float:
        """Where the trunk has come across [m]; the middle of the bar is the origin."""
        return self.depth / 2 + BEYOND


def build_corridor(config: BarConfig) -> Ground:
    """Walls, bar and what height scan and camera see of them, with the middle of the bar at the origin."""
    begin, end = -config.depth / 2 - APPROACH - SPREAD - _MARGIN, config.end + _MARGIN
    aside = (WIDTH + _WALL_THICKNESS) / 2
    walls = Boxes(
        np.array(
            [
                [(begin + end) / 2, side * aside, 0.0, end - begin, _WALL_THICKNESS, 0.0, _WALL_HEIGHT]
                for side in (-1.0, 1.0)
            ]
        )
    )
    bar = Blocks(np.array([[0.0, 0.0, np.pi / 2, WIDTH, config.depth, config.height]]))
    first, last = np.floor(begin / _RESOLUTION), np.ceil(end / _RESOLUTION)  # the bar is symmetric on the grid
    rows = 2 * round(2 * WIDTH / _RESOLUTION) + 1
    frame = GridFrame(first * _RESOLUTION, -2 * WIDTH, _RESOLUTION, (rows, round(last - first) + 1))
    field = flat_field(frame)
    raise_boxes(field, walls, WALL)
    raise_boxes(field, bar.boxes(), BLOCK)
    model = build_scene(walls, bar.boxes(), kp=config.kp, kd=config.kd)
    return Ground(model, field, np.zeros((1, 3)), np.array([-1]), ["bars"], np.inf, 0.0, bar, walls)


def draw_start(config: BarConfig, crossing: int) -> Start:
    """Where a crossing starts. Distances follow the golden ratio: those of any number of crossings are spread evenly,
    and the first ones of many are those of few."""
    rng = np.random.Generator(np.random.Philox(np.random.SeedSequence([config.seed, crossing])))
    farther = SPREAD * ((0.5 + crossing * _GOLDEN) % 1.0)
    y, yaw = rng.uniform(-_ASIDE, _ASIDE), rng.uniform(-_ASKEW, _ASKEW)
    joints = DEFAULT_POSE + rng.uniform(-_JOINTS, _JOINTS, 12)
    return Start(-config.depth / 2 - APPROACH - farther, float(y), float(yaw), joints, 0.0)
