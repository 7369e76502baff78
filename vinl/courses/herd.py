"""Several robots in MuJoCo C, each in a world of its own, driven together."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol, runtime_checkable

import mujoco
import numpy as np
from jaxtyping import Bool, Float

from vinl.chain.robot import Robot, Robots
from vinl.courses.block_contacts import BlockContacts
from vinl.courses.courses import Start
from vinl.courses.strain import Strain, StrainReader
from vinl.world.endings import MAX_TILT


@runtime_checkable
class Herd(Protocol):
    """Robots in whatever simulator.

    Attributes:
        qpos: (n, 19), qvel: (n, 18) of all robots, as after the last step or start.
        touches: what touched blocks in the last step.
        fallen: (n,) who had fallen at the end of the last step.
    """

    qpos: Float[np.ndarray, "n 19"]
    qvel: Float[np.ndarray, "n 18"]
    touches: BlockContacts
    fallen: Bool[np.ndarray, " n"]

    @property
    def strain(self) -> Strain | None:
        """What the last step took; None: this simulator does not tell."""
        ...

    def start(self, robot: int, start: Start) -> None:
        """Put a robot somewhere, at rest."""
        ...

    def step(self, targets: Float[np.ndarray, "n 12"]) -> None:
        """One control step to joint targets [rad]."""
        ...


class BoxHerd:
    """Robots in MuJoCo C, where blocks are boxes."""

    def __init__(self, model: mujoco.MjModel, n: int) -> None:
        self.touches, self._strain = BlockContacts.none(n), Strain.none(n)
        self.fallen = np.zeros(n, bool)
        each = [Robot(model) for _ in range(n)]
        self._readers = [StrainReader(model, r.data, self.touches, self._strain, k) for k, r in enumerate(each)]
        for robot, reader in zip(each, self._readers, strict=True):
            robot.contacts = reader
        self._robots = Robots(each)
        self.qpos, self.qvel = self._robots.qpos, self._robots.qvel

    @property
    def strain(self) -> Strain:
        """What the last step took."""
        return self._strain

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
