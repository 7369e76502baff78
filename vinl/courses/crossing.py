"""One policy over one bar: robots walk along a corridor and over the bar across it, around which there is no way, and
every touch is counted."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Bool, Float

from vinl.chain.scene import build_scene
from vinl.config.errors import InputError
from vinl.courses.block_contacts import BlockContacts
from vinl.courses.courses import Start
from vinl.courses.grounds import Ground
from vinl.courses.robot_records import GaitRecord, record_gait
from vinl.courses.trial import BoxHerd, controller_on_course
from vinl.policies.policy import Policy
from vinl.robot.aliengo import CONTROL_DT, DEFAULT_POSE
from vinl.robot.rotation import yaw_of
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
    """Height of a bar and its depth along the corridor [m], the commanded forward speed [m/s], the seed of the starts
    and the gains of the joints. Raises ``InputError`` if a number is out of range."""

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
    """Walls, bar and what gait and camera see of them, with the middle of the bar at the origin."""
    begin, end = -config.depth / 2 - APPROACH - SPREAD - _MARGIN, config.end + _MARGIN
    aside = (WIDTH + _WALL_THICKNESS) / 2
    middle, length = (begin + end) / 2, end - begin
    sides = [[middle, y, 0.0, length, _WALL_THICKNESS, 0.0, _WALL_HEIGHT] for y in (-aside, aside)]
    walls = Boxes(np.array(sides))
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


PATIENCE = 2.5
"""A crossing has so many times the time that it takes at the commanded speed; then it is not finished."""

_TO_HEADING, _TO_MIDDLE, _TURN_RATE = 1.5, 1.0, 0.5


@dataclass
class CrossingRecord:
    """One crossing, as it stands in ``results.json``. ``*_steps`` count control steps of 0.02 s in which something
    touched the bar in any of their physics steps.

    Attributes:
        crossing: its number, from which its start follows.
        height, depth: of the bar [m].
        start_m: from the trunk at the start to the middle of the bar [m].
        finished: the robot came across, without a fall.
        fell: it ended in a fall.
        time_s: length [s].
        metres: way of the trunk [m].
        foot_steps, leg_steps, trunk_steps: with any foot, any leg (hip, thigh, shank), the trunk on the bar.
        wall_steps: with anything on a wall.
        foot_pair_steps, leg_pair_steps: of the front and the rear ones.
        gait: how it walked.
    """

    crossing: int
    height: float
    depth: float
    start_m: float
    finished: bool = False
    fell: bool = False
    time_s: float = 0.0
    metres: float = 0.0
    foot_steps: int = 0
    leg_steps: int = 0
    trunk_steps: int = 0
    wall_steps: int = 0
    foot_pair_steps: list[int] = field(default_factory=lambda: [0, 0])
    leg_pair_steps: list[int] = field(default_factory=lambda: [0, 0])
    gait: GaitRecord = field(default_factory=GaitRecord)

    @property
    def touches(self) -> int:
        """Steps of feet, legs and trunk on the bar together: to find the best crossing by."""
        return self.foot_steps + self.leg_steps + self.trunk_steps


@dataclass(frozen=True, eq=False)
class CrossingTrace:
    """What pictures need of a crossing, step by step: where the robot was afterwards, and whether each foot, each leg,
    the trunk touched the bar."""

    qpos: Float[np.ndarray, "t 19"]
    feet: Bool[np.ndarray, "t 4"]
    legs: Bool[np.ndarray, "t 4"]
    trunk: Bool[np.ndarray, " t"]


@dataclass(frozen=True, eq=False)
class Crossing:
    """Record and trace."""

    record: CrossingRecord
    trace: CrossingTrace


def cross_bar(
    policy: Policy,
    config: BarConfig,
    ground: Ground,
    numbers: Sequence[int],
    is_stopped: Callable[[], bool] = lambda: False,
) -> list[Crossing]:
    """Walk over a bar of ``build_corridor``, steered along the middle of the corridor as a navigator would: by yaw
    rates alone. Once a second it is asked whether to give up."""
    n, starts = len(numbers), [draw_start(config, k) for k in numbers]
    records = [
        CrossingRecord(number, config.height, config.depth, -start.x)
        for number, start in zip(numbers, starts, strict=True)
    ]
    herd, controller = BoxHerd(ground.model, n), controller_on_course(policy, ground, n)
    controller.reset(n)
    for k, start in enumerate(starts):
        herd.start(k, start)
    limit = round(PATIENCE * (config.end - min(start.x for start in starts)) / config.speed / CONTROL_DT)
    alive = list(range(n))
    rows: list[tuple[np.ndarray, ...]] = []
    for step in range(limit):
        if step % 50 == 0 and is_stopped():
            break
        before = herd.qpos[:, :2].copy()
        herd.step(controller.step(herd.qpos, herd.qvel, steer(herd.qpos, config.speed), alive), alive)
        metres, touches = np.linalg.norm(herd.qpos[:, :2] - before, axis=1), herd.touches
        rows.append((herd.qpos.copy(), touches.feet.copy(), touches.legs.copy(), touches.trunk.copy()))
        record_gait([r.gait for r in records], herd.strain, herd.qpos, alive)
        for k in list(alive):
            _count(records[k], k, touches, float(metres[k]))
            records[k].finished = bool(herd.qpos[k, 0] > config.end and not herd.fallen[k])
            records[k].fell = bool(herd.fallen[k])
            if records[k].finished or records[k].fell:
                alive.remove(k)
        if not alive:
            break
    columns = [np.stack(column, 1) for column in zip(*rows, strict=True)]
    return [
        Crossing(record, CrossingTrace(*(column[k, : record.gait.steps] for column in columns)))
        for k, record in enumerate(records)
    ]


def steer(qpos: Float[np.ndarray, "n 19"], speed: float) -> Float[np.ndarray, "n 3"]:
    """Commands that lead along the x axis at a speed [m/s]."""
    turn = np.clip(-_TO_HEADING * yaw_of(np, qpos[:, 3:7]) - _TO_MIDDLE * qpos[:, 1], -_TURN_RATE, _TURN_RATE)
    return np.stack([np.full(len(qpos), speed), np.zeros(len(qpos)), turn], 1)


def _count(record: CrossingRecord, row: int, touches: BlockContacts, metres: float) -> None:
    """One control step of one robot."""
    record.time_s = round(record.time_s + CONTROL_DT, 6)
    record.metres += metres
    foot, leg, trunk = touches.count_pairs(row, record.foot_pair_steps, record.leg_pair_steps)
    record.foot_steps += foot
    record.leg_steps += leg
    record.trunk_steps += trunk
    record.wall_steps += int(touches.walls[row])
