"""Faults in the chain: a body that differs from its model, a state that is measured with errors."""

from __future__ import annotations

import math
from collections.abc import Sequence

import mujoco
import numpy as np
from jaxtyping import Float

from vinl.chain.fault_config import FaultConfig
from vinl.robot.aliengo import CONTROL_DT
from vinl.robot.rotation import matrix_of

BIAS_TIME = 1.0
"""The velocity bias forgets itself over this time [s]: an estimator's drift, not white noise."""

ANGULAR_NOISE, TILT_NOISE = 0.2, 0.05
"""Half-widths of the uniform noise that ``imu_noise`` multiplies: of the angular velocity [rad/s] and of the direction
of gravity [rad], as in legged_gym's training [ViNL config]."""


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
        faults: what is wrong.
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
        """Position and velocity as the robots know them, as new arrays. To be called once in every control step.

        Args:
            qpos, qvel: as they are.
            rows: the robots that still walk.
        """
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
