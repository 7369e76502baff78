"""One robot in its own MuJoCo data: spawn it, drive it for one action, keep the recorder of its episode."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterable, Sequence

import mujoco
import numpy as np
from jaxtyping import Float

from vinl.chain.contacts import ContactReader
from vinl.robot.aliengo import CONTROL_DT, STANDING_HEIGHT, SUBSTEPS, home_qpos


class DelayLine:
    """Hands joint targets on some physics steps late."""

    def __init__(self, late: int, first: Float[np.ndarray, "12"]) -> None:
        """``late`` in physics steps; ``first`` is what the motors hold before anything arrives."""
        self._late, calls = late, -(-late // SUBSTEPS)
        self._targets = deque([first.copy() for _ in range(calls + 1)], maxlen=calls + 1)

    def push(self, target: Float[np.ndarray, "12"]) -> list[Float[np.ndarray, "12"]]:
        """What reaches the motors in each of the next physics steps."""
        self._targets.append(target.copy())
        newest = len(self._targets) - 1
        return [self._targets[newest + (s - self._late) // SUBSTEPS] for s in range(SUBSTEPS)]


class Robot:
    """A robot and what it touches. ``qpos`` and ``qvel`` are views of its state.

    Args:
        model: the world.
        late: joint targets reach the motors so many physics steps late.
    """

    def __init__(self, model: mujoco.MjModel, late: int = 0) -> None:
        self._late, self._line = late, None
        self.model, self.data = model, mujoco.MjData(model)
        self.contacts = ContactReader(model, self.data)
        self.qpos: np.ndarray = self.data.qpos
        self.qvel: np.ndarray = self.data.qvel
        self._ctrl: np.ndarray = self.data.ctrl
        self._time = 0.0

    def spawn(self, x: float, y: float, yaw: float, joints: Float[np.ndarray, "12"], ground: float = 0.0) -> None:
        """Stand at rest at x, y [m] on ground of a height [m], with a heading and joint angles [rad]."""
        mujoco.mj_resetData(self.model, self.data)
        self.qpos[:] = home_qpos(x, y, ground + STANDING_HEIGHT, yaw)
        self.qpos[7:] = joints
        mujoco.mj_forward(self.model, self.data)
        self._time = 0.0
        self._line = DelayLine(self._late, joints) if self._late else None

    def take_over(self, before: Robot) -> None:
        """Go on as another robot, of another world, moves now."""
        for name in ("qpos", "qvel", "ctrl", "qacc_warmstart"):
            getattr(self.data, name)[:] = getattr(before.data, name)
        self._line = before._line
        mujoco.mj_forward(self.model, self.data)

    def step(self, target: Float[np.ndarray, "12"]) -> None:
        """Drive to joint targets [rad] for one control step, and latch the contacts of its physics steps."""
        self.contacts.clear()
        for sent in [target] * SUBSTEPS if self._line is None else self._line.push(target):
            self._ctrl[:] = sent
            mujoco.mj_step(self.model, self.data)
            self.contacts.look()
        self._time += CONTROL_DT

    def has_fallen(self, max_tilt: float) -> bool:
        """Whether the trunk is tilted farther than ``max_tilt`` [rad] or lies on the ground, or physics broke down
        (MuJoCo then starts the robot's time anew)."""
        upright = 1 - 2 * (self.qpos[4] ** 2 + self.qpos[5] ** 2)
        broken = abs(self.data.time - self._time) > CONTROL_DT / 2
        return bool(self.contacts.trunk_on_ground or broken or upright < math.cos(max_tilt))


class Robots:
    """Several robots side by side, each in MuJoCo data of its own.

    Attributes:
        qpos: (n, 19), qvel: (n, 18) of all, as after the last step or start.
    """

    def __init__(self, robots: Sequence[Robot]) -> None:
        self._robots = list(robots)
        self.qpos, self.qvel = (np.stack([getattr(r, name) for r in robots]) for name in ("qpos", "qvel"))

    def __getitem__(self, k: int) -> Robot:
        return self._robots[k]

    def __len__(self) -> int:
        return len(self._robots)

    def step(self, targets: Float[np.ndarray, "n 12"], rows: Iterable[int] | None = None) -> None:
        """One control step to joint targets [rad], of all robots or of those named; the others stay as they are."""
        for k in range(len(self)) if rows is None else rows:
            self._robots[k].step(targets[k])
            self.read(k)

    def read(self, k: int) -> None:
        """Take over the state of a robot that was put somewhere."""
        self.qpos[k], self.qvel[k] = self._robots[k].qpos, self._robots[k].qvel
