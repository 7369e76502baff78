"""What goes wrong with a real robot: late motors, wrong gains and masses, noisy sensors. Neutral by default."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, replace

import mujoco
import numpy as np
import torch
from jaxtyping import Float

from vinl.config.errors import InputError
from vinl.robot.aliengo import CONTROL_DT, PHYSICS_DT
from vinl.robot.cameras import Camera
from vinl.robot.rotation import matrix_of

BIAS_TIME = 1.0
"""The velocity bias forgets itself over this time [s]: an estimator's drift, not white noise."""

ANGULAR_NOISE, TILT_NOISE = 0.2, 0.05
"""Half-widths of the uniform noise that ``imu_noise`` multiplies: of the angular velocity [rad/s] and of the direction
of gravity [rad], as in legged_gym's training [ViNL config]."""


@dataclass(frozen=True)
class FaultConfig:
    """Faults of motors, body and sensors. The defaults change nothing, to the last bit.

    Attributes:
        action_delay: joint targets reach the motors so late [s]; a multiple of the physics step of 0.005 s.
        kp_scale, kd_scale: factors on the gains of all joints.
        mass_scale: factor on the mass and inertia of all links.
        friction_scale: factor on the friction of the feet and of all they touch.
        velocity_noise: standard deviation of white noise on the observed base velocity, each axis [m/s].
        velocity_bias: standard deviation of an error of the observed base velocity that changes over about a second,
            each axis [m/s].
        imu_noise: uniform noise on the observed angular velocity and direction of gravity, in multiples of 0.2 rad/s
            and 0.05 rad.
        camera_pitch: both cameras look down by so much more than they should [deg].
        camera_delay: images of both cameras are so old [s]; a multiple of the control step of 0.02 s.
        depth_noise: standard deviation of white noise on every pixel, as a fraction of its depth.
        depth_holes: fraction of the pixels, drawn anew in every image, that read as far as if nothing were there.

    Raises:
        InputError: a number is out of range.
    """

    action_delay: float = 0.0
    kp_scale: float = 1.0
    kd_scale: float = 1.0
    mass_scale: float = 1.0
    friction_scale: float = 1.0
    velocity_noise: float = 0.0
    velocity_bias: float = 0.0
    imu_noise: float = 0.0
    camera_pitch: float = 0.0
    camera_delay: float = 0.0
    depth_noise: float = 0.0
    depth_holes: float = 0.0

    def __post_init__(self) -> None:
        for name, low, high, unit in (
            ("action_delay", 0.0, 0.5, " s"),
            ("kp_scale", 0.1, 10.0, ""),
            ("kd_scale", 0.0, 10.0, ""),
            ("mass_scale", 0.1, 10.0, ""),
            ("friction_scale", 0.01, 10.0, ""),
            ("velocity_noise", 0.0, 10.0, " m/s"),
            ("velocity_bias", 0.0, 10.0, " m/s"),
            ("imu_noise", 0.0, 10.0, ""),
            ("camera_pitch", -60.0, 60.0, " deg"),
            ("camera_delay", 0.0, 2.0, " s"),
            ("depth_noise", 0.0, 1.0, ""),
            ("depth_holes", 0.0, 1.0, ""),
        ):
            value = getattr(self, name)
            if not low <= value <= high:
                raise InputError(f"faults.{name} must lie between {low:g} and {high:g}{unit}, got {value:g}")
        for name, step in (("action_delay", PHYSICS_DT), ("camera_delay", CONTROL_DT)):
            value = getattr(self, name)
            if abs(value / step - round(value / step)) > 1e-6:
                raise InputError(f"faults.{name} must be a multiple of {step:g} s, got {value:g}")

    @property
    def delay_steps(self) -> int:
        """Physics steps that joint targets are late."""
        return round(self.action_delay / PHYSICS_DT)

    @property
    def spoils_state(self) -> bool:
        """Whether what is measured of the robot's state differs from what it is."""
        return self.velocity_noise > 0 or self.velocity_bias > 0 or self.imu_noise > 0

    @property
    def spoils_images(self) -> bool:
        """Whether pixels are disturbed."""
        return self.depth_noise > 0 or self.depth_holes > 0

    def mount(self, camera: Camera) -> Camera:
        """The camera as it is mounted, in place of where it should be."""
        if self.camera_pitch == 0:
            return camera
        return replace(camera, pitch_down=camera.pitch_down + math.radians(self.camera_pitch))

    def change_body(self, model: mujoco.MjModel) -> None:
        """Mass and friction of a compiled world, in place."""
        if self.friction_scale != 1:
            model.geom_friction[:] *= self.friction_scale
        if self.mass_scale != 1:
            model.body_mass[:] *= self.mass_scale
            model.body_inertia[:] *= self.mass_scale
            mujoco.mj_setConst(model, mujoco.MjData(model))


class FaultySensors:
    """What n robots measure in place of what is. Every robot has random numbers of its own.

    Args:
        config: the faults.
        rngs: the only sources of chance, one for each robot.
    """

    def __init__(self, config: FaultConfig, rngs: Sequence[np.random.Generator]) -> None:
        self._config = config
        # a stream for each sensor: a fault of one changes no number of another
        self._velocity, self._imu, *self._pixels = zip(*(rng.spawn(4) for rng in rngs), strict=True)
        self._bias = config.velocity_bias * np.stack([rng.standard_normal(3) for rng in self._velocity])
        self._past: deque[np.ndarray] = deque(maxlen=round(config.camera_delay / CONTROL_DT) + 1)

    def measure(
        self, qpos: Float[np.ndarray, "n 19"], qvel: Float[np.ndarray, "n 18"], rows: Sequence[int]
    ) -> tuple[Float[np.ndarray, "n 19"], Float[np.ndarray, "n 18"]]:
        """Position and velocity as the robots know them. To be called once in every control step.

        Args:
            qpos, qvel: as they are.
            rows: the robots that still walk.
        """
        self._past.append(qpos.copy())
        if not self._config.spoils_state:
            return qpos, qvel
        config, qpos, qvel = self._config, qpos.copy(), qvel.copy()
        keep = math.exp(-CONTROL_DT / BIAS_TIME)
        for k in rows:
            drift, white = self._velocity[k].standard_normal((2, 3))
            self._bias[k] = keep * self._bias[k] + math.sqrt(1 - keep**2) * config.velocity_bias * drift
            error = self._bias[k] + config.velocity_noise * white
            qvel[k, :3] += matrix_of(np, qpos[k : k + 1, 3:7])[0] @ error
            if config.imu_noise > 0:
                turning, tilt = self._imu[k].uniform(-config.imu_noise, config.imu_noise, (2, 3))
                qvel[k, 3:6] += ANGULAR_NOISE * turning
                tilt[2] = 0.0  # gravity tells nothing of the heading
                mujoco.mju_quatIntegrate(qpos[k, 3:7], TILT_NOISE * tilt, 1.0)
        return qpos, qvel

    def view_from(self) -> Float[np.ndarray, "n 19"]:
        """Where the robots were when the images were taken that arrive now. The world stands still: an old image is
        one from an old place."""
        return self._past[0]

    def spoil(
        self, depth: Float[torch.Tensor, "n height width"], camera: Camera, rows: Sequence[int]
    ) -> Float[torch.Tensor, "n height width"]:
        """Images with noise and holes; the given ones stay as they are.

        Args:
            depth: [m].
            camera: which.
            rows: the robots that still walk.
        """
        if not self._config.spoils_images:
            return depth
        depth = depth.clone()
        streams = self._pixels[camera.name == "navigation"]
        for k in rows:
            image, size = depth[k], tuple(depth.shape[1:])
            noise = torch.from_numpy(streams[k].standard_normal(size, np.float32))
            holes = torch.from_numpy(streams[k].random(size, np.float32) < self._config.depth_holes)
            noisy = (image * (1 + self._config.depth_noise * noise)).clamp(0.0, camera.far)
            depth[k] = torch.where(holes | (image >= camera.far), camera.far, noisy)
        return depth


class DelayLine:
    """Hands joint targets on some physics steps late."""

    def __init__(self, late: int, first: Float[np.ndarray, "12"], substeps: int) -> None:
        """``late`` in physics steps; ``first`` is what the motors hold before anything arrives; ``substeps`` a call."""
        self._late, self._substeps = late, substeps
        calls = -(-late // substeps)
        self._targets = deque([first.copy() for _ in range(calls + 1)], maxlen=calls + 1)

    def push(self, target: Float[np.ndarray, "12"]) -> list[Float[np.ndarray, "12"]]:
        """What reaches the motors in each of the next physics steps."""
        self._targets.append(target.copy())
        newest = len(self._targets) - 1
        return [self._targets[newest + (s - self._late) // self._substeps] for s in range(self._substeps)]
