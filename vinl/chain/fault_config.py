"""What goes wrong with a real robot's body: late motors, wrong gains and masses, a noisy idea of its own motion.
Neutral by default. Errors of its cameras are ``sensing.sensor_config``'s."""

from __future__ import annotations

from dataclasses import dataclass

from vinl.config.errors import InputError
from vinl.robot.aliengo import PHYSICS_DT


@dataclass(frozen=True)
class FaultConfig:
    """Faults of motors, body and state estimate. The defaults change nothing, to the last bit.

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
        ):
            value = getattr(self, name)
            if not low <= value <= high:
                raise InputError(f"faults.{name} must lie between {low:g} and {high:g}{unit}, got {value:g}")
        if abs(self.action_delay / PHYSICS_DT - self.delay_steps) > 1e-6:
            raise InputError(f"faults.action_delay must be a multiple of {PHYSICS_DT:g} s, got {self.action_delay:g}")

    @property
    def delay_steps(self) -> int:
        """Physics steps that joint targets are late."""
        return round(self.action_delay / PHYSICS_DT)

    @property
    def spoils_state(self) -> bool:
        """Whether the robot's velocity or attitude is measured with errors."""
        return self.velocity_noise > 0 or self.velocity_bias > 0 or self.imu_noise > 0

    @property
    def is_neutral(self) -> bool:
        """Whether nothing is wrong."""
        return self == FaultConfig()
