"""What walking takes out of a robot in MuJoCo C, read after every physics step."""

from __future__ import annotations

from typing import NamedTuple

import mujoco
import numpy as np
from jaxtyping import Bool, Float

from vinl.chain.scene import FORCE_SENSORS, TOUCH_SENSORS
from vinl.courses.block_contacts import BlockContactReader, BlockContacts
from vinl.robot.aliengo import JOINT_SPEED_LIMIT, LEGS, PHYSICS_DT, SUBSTEPS


class Strain(NamedTuple):
    """What one control step took, robot by robot, over all its physics steps.

    Attributes:
        work: (n,) mechanical work of the joints, positive and negative alike [J].
        speed: (n,) the fastest joint, as a fraction of what the data sheet allows.
        leg_leg: (n,) whether a leg touched another.
        own_body: (n,) whether the robot touched itself at all.
        stance: (n, 4) which feet carried, in the order of ``LEGS``.
    """

    work: Float[np.ndarray, " n"]
    speed: Float[np.ndarray, " n"]
    leg_leg: Bool[np.ndarray, " n"]
    own_body: Bool[np.ndarray, " n"]
    stance: Bool[np.ndarray, "n 4"]

    @classmethod
    def none(cls, n: int) -> Strain:
        """Robots that float at rest."""
        return cls(np.zeros(n), np.zeros(n), np.zeros(n, bool), np.zeros(n, bool), np.zeros((n, 4), bool))


class StrainReader(BlockContactReader):
    """Also notes torques, joint speeds, forces on the feet and where the robot touches itself.

    Args:
        model: the world.
        data: of one robot in it.
        touches: where to note touches of blocks.
        strain: where to note the rest.
        row: the robot's row there.
    """

    def __init__(
        self, model: mujoco.MjModel, data: mujoco.MjData, touches: BlockContacts, strain: Strain, row: int
    ) -> None:
        bodies = [model.body(k).name.split("_")[0] for k in range(model.nbody)]
        self._leg_of = np.array([LEGS.index(name) if name in LEGS else -1 for name in bodies])[model.geom_bodyid]
        self._strain, self._at, self._substep = strain, row, 0
        self._torque, self._speed = data.actuator_force, data.qvel[6:]
        first = int(model.sensor(FORCE_SENSORS[0]).adr[0])
        self._load = data.sensordata[first : first + 12]
        self._self = data.sensordata[int(model.sensor(TOUCH_SENSORS[3]).adr[0]) :][:1]
        self._torques, self._speeds, self._loads = (np.zeros((SUBSTEPS, 12)) for _ in range(3))
        super().__init__(model, data, touches, row)

    def clear(self) -> None:
        """A new control step begins."""
        super().clear()
        self._substep = 0
        self._strain.leg_leg[self._at] = self._strain.own_body[self._at] = False

    def look(self) -> None:
        """Note what the last physics step took."""
        super().look()
        k = self._substep
        self._torques[k], self._speeds[k], self._loads[k] = self._torque, self._speed, self._load
        self._substep = k + 1
        if self._self[0]:
            self._strain.own_body[self._at] = True
            a, b = self._data.contact.geom.T
            legs = self._leg_of[a], self._leg_of[b]
            self._strain.leg_leg[self._at] |= bool(((legs[0] != legs[1]) & (legs[0] >= 0) & (legs[1] >= 0)).any())

    def sum_up(self) -> None:
        """The control step has ended."""
        strain, k, taken = self._strain, self._at, slice(self._substep)
        strain.work[k] = np.abs(self._torques[taken] * self._speeds[taken]).sum() * PHYSICS_DT
        strain.speed[k] = (np.abs(self._speeds[taken]) / JOINT_SPEED_LIMIT).max()
        strain.stance[k] = self._loads[taken].reshape(-1, 4, 3).any((0, 2))
