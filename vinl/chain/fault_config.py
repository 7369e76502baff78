"""What goes wrong with a real robot: late motors, wrong gains and masses, noisy sensors. Neutral by default."""

from __future__ import annotations

from dataclasses import dataclass, replace

from vinl.config.errors import InputError
from vinl.robot.aliengo import CONTROL_DT, PHYSICS_DT
from vinl.sensing.sensor_config import SensorConfig


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
        depth_noise: standard deviation of white noise on the pixels of both cameras, as a multiple of the depth squared
            [1/m]: 0.02 is 2 % at 1 m. See ``sensing.sensor_config``.
        depth_holes: fraction of the pixels of both cameras, drawn anew in every image, without a return.

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
            ("camera_delay", 0.0, 0.4, " s"),
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
        """Whether the robot's velocity or attitude is measured with errors."""
        return self.velocity_noise > 0 or self.velocity_bias > 0 or self.imu_noise > 0

    def add_to(self, sensors: SensorConfig) -> SensorConfig:
        """Errors of the depth cameras with these faults added; the very same record without any."""
        late = self.camera_delay
        if not (late or self.depth_noise or self.depth_holes):
            return sensors
        return replace(
            sensors,
            noise=sensors.noise + self.depth_noise,
            pixels=min(sensors.pixels + self.depth_holes, 1.0),
            delay=(sensors.delay[0] + late, sensors.delay[1] + late),
        )

    @property
    def is_neutral(self) -> bool:
        """Whether nothing is wrong."""
        return self == FaultConfig()
