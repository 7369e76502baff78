"""Which foot and which leg touches which block, and what walking takes out of a robot, latched over the physics steps
of one action."""

from __future__ import annotations

from typing import NamedTuple

import mujoco
import numpy as np
from jaxtyping import Bool, Float

from vinl.chain.robot import KINDS, ContactReader
from vinl.chain.scene import BLOCKS, FORCE_SENSORS, TOUCH_SENSORS
from vinl.robot.aliengo import FOOT_GEOMS, JOINT_SPEED_LIMIT, LEGS, PHYSICS_DT, SUBSTEPS

HEIGHT_EDGES = (0.10, 0.12, 0.14, 0.16, 0.18, 0.20)
"""Blocks are told apart by height in these bins [m]; lower and higher ones count in the first and the last."""

BINS = len(HEIGHT_EDGES) - 1

_TRUNK_ON_BLOCK = KINDS.index("trunk_block")
_WALL_KINDS = {k for k, name in enumerate(KINDS) if name.endswith("_wall")}


def bin_heights(heights: np.ndarray) -> np.ndarray:
    """The bin of every height [m]."""
    return np.clip(np.digitize(heights, HEIGHT_EDGES) - 1, 0, BINS - 1)


class BlockContacts(NamedTuple):
    """What touched blocks in one control step, robot by robot: feet and legs in the order of ``LEGS`` (a leg is hip,
    thigh and shank), whether any foot, any leg touched a block of a bin of height, whether the trunk touched one; and
    whether anything touched a wall."""

    feet: Bool[np.ndarray, "n 4"]
    legs: Bool[np.ndarray, "n 4"]
    foot_bins: Bool[np.ndarray, "n bins"]
    leg_bins: Bool[np.ndarray, "n bins"]
    trunk: Bool[np.ndarray, " n"]
    walls: Bool[np.ndarray, " n"]

    @classmethod
    def none(cls, n: int) -> BlockContacts:
        """No touch."""
        return cls(*(np.zeros(shape, bool) for shape in ((n, 4), (n, 4), (n, BINS), (n, BINS), n, n)))

    def count_pairs(self, row: int, feet: list[int], legs: list[int]) -> tuple[int, int, int]:
        """Add a robot's touches to counts of its front and rear feet and legs; 1 where any foot, any leg, the trunk
        touched a block."""
        for flags, counts in ((self.feet[row], feet), (self.legs[row], legs)):
            counts[0] += int(flags[:2].any())
            counts[1] += int(flags[2:].any())
        return int(self.feet[row].any()), int(self.legs[row].any()), int(self.trunk[row])


class Strain(NamedTuple):
    """What one control step took, robot by robot, over all its physics steps: mechanical work of the joints, positive
    and negative alike [J]; the fastest joint, as a fraction of what the data sheet allows; whether a leg touched
    another, and whether the robot touched itself at all; which feet carried, in the order of ``LEGS``."""

    work: Float[np.ndarray, " n"]
    speed: Float[np.ndarray, " n"]
    leg_leg: Bool[np.ndarray, " n"]
    own_body: Bool[np.ndarray, " n"]
    stance: Bool[np.ndarray, "n 4"]

    @classmethod
    def none(cls, n: int) -> Strain:
        """Robots that float at rest."""
        return cls(np.zeros(n), np.zeros(n), np.zeros(n, bool), np.zeros(n, bool), np.zeros((n, 4), bool))


class StrainReader(ContactReader):
    """Also notes which feet and legs touch blocks of what height, torques, joint speeds, forces on the feet, and where
    the robot touches itself: in its ``row`` of ``touches`` and ``strain``."""

    def __init__(
        self, model: mujoco.MjModel, data: mujoco.MjData, touches: BlockContacts, strain: Strain, row: int
    ) -> None:
        self._out, self._strain, self._row, self._substep = touches, strain, row, 0
        names = [model.body(k).name for k in range(model.nbody)]
        is_leg = np.array([name.endswith(("_hip", "_thigh", "_calf")) for name in names])[model.geom_bodyid]
        number = np.array([LEGS.index(name[:2]) if name[:2] in LEGS else -1 for name in names])
        limb, height = np.where(is_leg, 1, -1), np.full(model.ngeom, -1)
        limb[[model.geom(name).id for name in FOOT_GEOMS]] = 0
        blocks = model.geom_bodyid == model.body(BLOCKS).id
        height[blocks] = bin_heights(2 * model.geom_size[blocks, 2])
        self._limb, self._leg, self._height = limb, number[model.geom_bodyid], height
        self._torque, self._speed = data.actuator_force, data.qvel[6:]
        first = int(model.sensor(FORCE_SENSORS[0]).adr[0])
        self._load = data.sensordata[first : first + 12]
        self._self = data.sensordata[int(model.sensor(TOUCH_SENSORS[3]).adr[0]) :][:1]
        self._torques, self._speeds, self._loads = (np.zeros((SUBSTEPS, 12)) for _ in range(3))
        super().__init__(model, data)

    def clear(self) -> None:
        """Forget the touches: a new control step begins."""
        super().clear()
        self._substep = 0
        for flags in (*self._out, self._strain.leg_leg, self._strain.own_body):
            flags[self._row] = False

    def look(self) -> None:
        """Latch what the last physics step touched, and what it took."""
        super().look()
        k = self._substep
        self._torques[k], self._speeds[k], self._loads[k] = self._torque, self._speed, self._load
        self._substep = k + 1
        if self._self[0]:
            self._strain.own_body[self._row] = True
            one, other = self._leg[self._data.contact.geom.T]
            self._strain.leg_leg[self._row] |= bool(((one != other) & (one >= 0) & (other >= 0)).any())
        if _WALL_KINDS & self.touches.keys():
            self._out.walls[self._row] = True
        if self._touch[0]:
            self._look_at_blocks()

    def _look_at_blocks(self) -> None:
        self._out.trunk[self._row] |= _TRUNK_ON_BLOCK in self.touches
        geoms = self._data.contact.geom
        limb, height = self._limb[geoms].max(1), self._height[geoms].max(1)
        for k in np.flatnonzero((limb >= 0) & (height >= 0)):
            a, b = geoms[k]
            leg = self._leg[a if self._limb[a] >= 0 else b]
            by_leg, by_bin = (
                (self._out.feet, self._out.foot_bins) if limb[k] == 0 else (self._out.legs, self._out.leg_bins)
            )
            by_leg[self._row, leg] = True
            by_bin[self._row, height[k]] = True

    def sum_up(self) -> None:
        """The control step has ended."""
        strain, k, taken = self._strain, self._row, slice(self._substep)
        strain.work[k] = np.abs(self._torques[taken] * self._speeds[taken]).sum() * PHYSICS_DT
        strain.speed[k] = (np.abs(self._speeds[taken]) / JOINT_SPEED_LIMIT).max()
        strain.stance[k] = self._loads[taken].reshape(-1, 4, 3).any((0, 2))
