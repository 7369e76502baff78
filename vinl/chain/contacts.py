"""What the robot touches, latched over the physics steps of one action: a touch of 5 ms counts."""

from __future__ import annotations

from typing import NamedTuple

import mujoco
import numpy as np

from vinl.chain.scene import BLOCKS, FORCE_SENSORS, TOUCH_SENSORS, WALLS
from vinl.robot.aliengo import FOOT_GEOMS

KINDS = ("foot_block", "foot_wall", "leg_block", "leg_wall", "trunk_block", "trunk_wall")
"""What may touch what. A leg is hip, thigh and shank; furniture counts as wall."""

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
