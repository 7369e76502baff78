"""One robot in its own MuJoCo data: spawn it, drive it for one action, latch what it touches over the physics steps (a
touch of 5 ms counts); a body that differs from its model, a state that is measured with errors."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterable, Sequence
from typing import NamedTuple

import mujoco
import numpy as np
from jaxtyping import Float

from vinl.chain.config import FaultConfig
from vinl.chain.scene import BLOCKS, FORCE_SENSORS, TOUCH_SENSORS, WALLS, build_scene
from vinl.policies.card import PolicyCard
from vinl.robot.aliengo import CONTROL_DT, FOOT_GEOMS, STANDING_HEIGHT, SUBSTEPS, home_qpos
from vinl.robot.rotation import matrix_of
from vinl.world.boxes import Boxes

KINDS = ("foot_block", "foot_wall", "leg_block", "leg_wall", "trunk_block", "trunk_wall")
"""What may touch what. A leg is hip, thigh and shank; furniture counts as wall."""

KINDS_OF = {
    limb: tuple(k for k, kind in enumerate(KINDS) if kind.startswith(limb)) for limb in ("foot", "leg", "trunk")
}
"""Numbers of the kinds of contact of each limb."""

FOOT_LIFT = 0.05
"""The paper's rule: a foot whose middle is higher than this [m] stands on something [ViNL code]."""

STUMBLE_RATIO = 5.0
"""The paper's rule: a horizontal force of so many times the vertical one hits a side [ViNL code]."""


class Touch(NamedTuple):
    """One kind of contact in one control step: index into ``KINDS``, and where [m]."""

    kind: int
    x: float
    y: float
    z: float


class ContactReader:
    """Reads one robot's contacts after each ``mj_step``. ``data`` must stay the one it was made for."""

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData) -> None:
        self._data = data
        names = [model.body(k).name for k in range(model.nbody)]
        of_body = [1 if name.endswith(("_hip", "_thigh", "_calf")) else 2 if name == "trunk" else -1 for name in names]
        part = np.array(of_body)[model.geom_bodyid]
        part[[model.geom(name).id for name in FOOT_GEOMS]] = 0
        obstacle = np.full(model.ngeom, -1)
        for k, name in enumerate((BLOCKS, WALLS)):
            obstacle[model.geom_bodyid == model.body(name).id] = k
        self._part, self._obstacle = part, obstacle
        adr = [int(model.sensor(name).adr[0]) for name in TOUCH_SENSORS]
        self._touch = data.sensordata[adr[0] : adr[0] + 2]
        self._ground = data.sensordata[adr[2] : adr[2] + 1]
        adr = int(model.sensor(FORCE_SENSORS[0]).adr[0])
        self._forces = data.sensordata[adr : adr + 12].reshape(4, 3)
        first = [int(model.geom(name).id) for name in FOOT_GEOMS]
        self._feet = [data.geom_xpos[g] for g in first]
        self.clear()

    def clear(self) -> None:
        """Forget the touches: a new control step begins."""
        self.touches: dict[int, Touch] = {}
        self.trunk_on_ground = False

    def look(self) -> None:
        """Latch what the last physics step touched."""
        if self._ground[0]:
            self.trunk_on_ground = True
        if self._touch[0] or self._touch[1]:
            self._classify()

    def _classify(self) -> None:
        contact = self._data.contact
        geoms = contact.geom
        part, obstacle = self._part[geoms].max(1), self._obstacle[geoms].max(1)
        for k in np.flatnonzero((part >= 0) & (obstacle >= 0)):
            kind = int(2 * part[k] + obstacle[k])
            if kind not in self.touches:
                self.touches[kind] = Touch(kind, *contact.pos[k].tolist())

    def breaks_paper_rule(self) -> bool:
        """The paper's own count, from the last physics step of the control step: any foot higher than 0.05 m with any
        vertical force, or with a horizontal force of five times the vertical one [ViNL code]."""
        for foot, (fx, fy, fz) in zip(self._feet, self._forces.tolist(), strict=True):
            if fx == 0.0 and fy == 0.0 and fz == 0.0:
                continue
            if (foot[2] >= FOOT_LIFT and fz != 0.0) or np.hypot(fx, fy) > STUMBLE_RATIO * abs(fz):
                return True
        return False


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


BIAS_TIME = 1.0
"""The velocity bias forgets itself over this time [s]: an estimator's drift, not white noise."""

ANGULAR_NOISE, TILT_NOISE = 0.2, 0.05
"""Half-widths of the uniform noise that ``imu_noise`` multiplies: of the angular velocity [rad/s] and of the direction
of gravity [rad], as in legged_gym's training [ViNL config]."""


def build_model(walls: Boxes, blocks: Boxes, card: PolicyCard, faults: FaultConfig) -> mujoco.MjModel:
    """A robot's world, with the gains of the card of a locomotion policy, and with faults of motors and body."""
    kp, kd = (float(card.action[key]) for key in ("kp", "kd"))
    model = build_scene(walls, blocks, kp=kp * faults.kp_scale, kd=kd * faults.kd_scale)
    change_body(model, faults)
    return model


def change_body(model: mujoco.MjModel, faults: FaultConfig) -> None:
    """Masses and friction of a compiled world, in place."""
    if faults.friction_scale != 1:
        model.geom_friction[:] *= faults.friction_scale
    if faults.mass_scale != 1:
        model.body_mass[:] *= faults.mass_scale
        model.body_inertia[:] *= faults.mass_scale
        mujoco.mj_setConst(model, mujoco.MjData(model))


class FaultyState:
    """What n robots know of their velocity and attitude in place of what is. Every robot has random numbers of its own.

    Args:
        rngs: the only sources of chance, one for each robot.
    """

    def __init__(self, faults: FaultConfig, rngs: Sequence[np.random.Generator]) -> None:
        self._faults = faults
        # a stream for each sensor: a fault of one changes no number of another
        self._velocity, self._imu = zip(*(rng.spawn(2) for rng in rngs), strict=True)
        self._bias = faults.velocity_bias * np.stack([rng.standard_normal(3) for rng in self._velocity])

    def measure(
        self, qpos: Float[np.ndarray, "n 19"], qvel: Float[np.ndarray, "n 18"], rows: Sequence[int]
    ) -> tuple[Float[np.ndarray, "n 19"], Float[np.ndarray, "n 18"]]:
        """Position and velocity as the robots know them, as new arrays. To be called once in every control step."""
        faults, qpos, qvel = self._faults, qpos.copy(), qvel.copy()
        keep = math.exp(-CONTROL_DT / BIAS_TIME)
        for k in rows:
            drift, white = self._velocity[k].standard_normal((2, 3))
            self._bias[k] = keep * self._bias[k] + math.sqrt(1 - keep**2) * faults.velocity_bias * drift
            error = self._bias[k] + faults.velocity_noise * white
            qvel[k, :3] += matrix_of(np, qpos[k : k + 1, 3:7])[0] @ error
            if faults.imu_noise > 0:
                turning, tilt = self._imu[k].uniform(-faults.imu_noise, faults.imu_noise, (2, 3))
                qvel[k, 3:6] += ANGULAR_NOISE * turning
                tilt[2] = 0.0  # gravity tells nothing of the heading
                mujoco.mju_quatIntegrate(qpos[k, 3:7], TILT_NOISE * tilt, 1.0)
        return qpos, qvel
