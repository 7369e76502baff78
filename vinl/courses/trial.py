"""One trial: a policy drives a herd, several robots each in a world of its own, along its courses, whatever simulator
the herd lives in."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Protocol, runtime_checkable

import mujoco
import numpy as np
from jaxtyping import Bool, Float

from vinl.chain.controller import LocomotionController
from vinl.chain.depth_cameras import DepthCameras
from vinl.chain.ground_reader import GaitReader, map_ground
from vinl.chain.metrics import tracking_errors
from vinl.chain.robot import Robot, Robots
from vinl.courses.block_contacts import BlockContacts, Strain, StrainReader
from vinl.courses.courses import Course, Start
from vinl.courses.grounds import Ground
from vinl.courses.robot_records import RobotRecord, StepCounter, record_gait
from vinl.policies.card import find_gait
from vinl.policies.policy import Policy
from vinl.world.endings import MAX_TILT
from vinl.world.grid import WALL


@runtime_checkable
class Herd(Protocol):
    """Robots in whatever simulator: ``qpos`` and ``qvel`` of all, as after the last step or start, what touched blocks
    in the last step, and who had fallen at its end."""

    qpos: Float[np.ndarray, "n 19"]
    qvel: Float[np.ndarray, "n 18"]
    touches: BlockContacts
    fallen: Bool[np.ndarray, " n"]

    @property
    def strain(self) -> Strain | None:
        """What the last step took; None: this simulator does not tell."""

    def start(self, robot: int, start: Start) -> None:
        """Put a robot somewhere, at rest."""

    def step(self, targets: Float[np.ndarray, "n 12"]) -> None:
        """One control step to joint targets [rad]."""


class BoxHerd:
    """Robots in MuJoCo C, where blocks are boxes; see ``Herd``."""

    def __init__(self, model: mujoco.MjModel, n: int) -> None:
        self.touches, self.strain = BlockContacts.none(n), Strain.none(n)
        self.fallen = np.zeros(n, bool)
        each = [Robot(model) for _ in range(n)]
        self._readers = [StrainReader(model, r.data, self.touches, self.strain, k) for k, r in enumerate(each)]
        for robot, reader in zip(each, self._readers, strict=True):
            robot.contacts = reader
        self._robots = Robots(each)
        self.qpos, self.qvel = self._robots.qpos, self._robots.qvel

    def start(self, robot: int, start: Start) -> None:
        """Put a robot somewhere, at rest."""
        self._robots[robot].spawn(start.x, start.y, start.yaw, start.joints, start.ground)
        self._robots.read(robot)

    def step(self, targets: Float[np.ndarray, "n 12"], rows: Sequence[int] | None = None) -> None:
        """One control step to joint targets [rad], of all robots or of those named; the others stay as they are."""
        self._robots.step(targets, rows)
        for k in range(len(self._robots)) if rows is None else rows:
            self._readers[k].sum_up()
            self.fallen[k] = self._robots[k].has_fallen(MAX_TILT)


LEAD = 0.5
"""Steps count from so far from the last start on [m]: all feet then come to ground that the robot has seen."""

SETTLED = 50
"""Control steps after a new command, or a new start, that the ``settled`` errors leave out."""


def run_trial(
    herd: Herd,
    ground: Ground,
    courses: Sequence[Course],
    policy: Policy,
    is_stopped: Callable[[], bool] = lambda: False,
) -> list[RobotRecord]:
    """Drive all robots of a herd, one for each course, to the end of their commands, and count, robot by robot.

    A robot that falls, or comes to the end of its ground, starts afresh; its commands go on as they would have.
    ``is_stopped`` is asked once a second whether to give up.
    """
    n = len(courses)
    levels = [int(ground.levels[course.home]) for course in courses]
    records = [
        RobotRecord(course.robot, ground.kinds[course.home], level if level >= 0 else None)
        for course, level in zip(courses, levels, strict=True)
    ]
    homes = np.array([ground.homes[course.home, :2] for course in courses])
    commands, fresh = np.stack([c.commands for c in courses], 1), np.stack([c.fresh for c in courses], 1)
    controller = controller_on_course(policy, ground, n)
    controller.reset(n)
    for k, course in enumerate(courses):
        herd.start(k, course.draw_start())
    age = np.zeros(n, int)
    begun, counter, gaits = herd.qpos[:, :2].copy(), StepCounter(n), [record.gait for record in records]
    for step in range(len(commands)):
        if step % SETTLED == 0 and is_stopped():
            break
        age[fresh[step]] = 0
        before = herd.qpos[:, :2].copy()
        herd.step(controller.step(herd.qpos, herd.qvel, commands[step]))
        metres = np.linalg.norm(herd.qpos[:, :2] - before, axis=1)
        _add_errors(records, herd.qpos, herd.qvel, commands[step], age >= SETTLED)
        _add_touches(records, herd.touches, metres, herd.fallen)
        if herd.strain is not None:
            record_gait(gaits, herd.strain, herd.qpos)
            far = np.linalg.norm(herd.qpos[:, :2] - begun, axis=1) > LEAD
            counter.add(herd.strain.stance, herd.touches.feet, herd.touches.legs, far)
        for k in np.flatnonzero(ground.on_block(herd.qpos[:, :2])).tolist():
            records[k].over_block_steps += 1
        age += 1
        fallen = herd.fallen.copy()
        away = fallen | (np.abs(herd.qpos[:, :2] - homes).max(1) > ground.reach)
        for k in np.flatnonzero(away).tolist():
            herd.start(k, courses[k].draw_start())
            age[k], begun[k] = 0, herd.qpos[k, :2]
        if away.any():
            controller.reset(away)
            counter.restart(away, fallen)
    for k, record in enumerate(records):
        record.swings, record.dirty_swings = int(counter.steps[k]), int(counter.dirty[k])
        record.dirty_foot_swings = int(counter.dirty_foot[k])
    return records


def controller_on_course(policy: Policy, ground: Ground, n: int) -> LocomotionController:
    """What a policy of n robots observes on a ground that all of them walk on."""
    cameras = None if policy.camera is None else DepthCameras([ground.mesh()], [0] * n, policy.camera)
    config = find_gait(policy.card)
    gait = None
    if config is not None:
        bare = np.where(ground.field.labels == WALL, 0.0, ground.field.heights).astype(np.float32)
        gait = GaitReader(config, map_ground(bare, ground.field.frame, ground.blocks.boxes() + ground.walls))
    return LocomotionController(policy, cameras, gait)


def _add_touches(
    records: Sequence[RobotRecord],
    touches: BlockContacts,
    metres: Float[np.ndarray, " n"],
    fallen: Bool[np.ndarray, " n"],
) -> None:
    for k, record in enumerate(records):
        record.metres += float(metres[k])
        record.falls += int(fallen[k])
    for k in np.flatnonzero(touches.feet.any(1) | touches.legs.any(1) | touches.trunk).tolist():
        record = records[k]
        foot, leg, trunk = touches.count_pairs(k, record.foot_pair_steps, record.leg_pair_steps)
        record.foot_block_steps += foot
        record.leg_block_steps += leg
        record.trunk_block_steps += trunk
        for j in np.flatnonzero(touches.foot_bins[k]).tolist():
            record.foot_height_steps[j] += 1
        for j in np.flatnonzero(touches.leg_bins[k]).tolist():
            record.leg_height_steps[j] += 1


def _add_errors(
    records: Sequence[RobotRecord],
    qpos: Float[np.ndarray, "n 19"],
    qvel: Float[np.ndarray, "n 18"],
    command: Float[np.ndarray, "n 3"],
    settled: Bool[np.ndarray, " n"],
) -> None:
    errors = tracking_errors(qpos, qvel, command)
    for record, (a, b), calm in zip(records, errors.tolist(), settled.tolist(), strict=True):
        record.steps += 1
        record.errors[0] += a
        record.errors[1] += b
        if calm:
            record.settled_steps += 1
            record.errors[2] += a
            record.errors[3] += b
