"""The rules of an evaluation: limits of an episode, what counts as an end, how the oracle walks, what goes wrong with
a real robot's body."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from vinl.config.errors import InputError
from vinl.config.limits import check_fields, check_limits
from vinl.robot.aliengo import PHYSICS_DT
from vinl.sensing.sensor_config import OdometryConfig, SensorConfig
from vinl.world.endings import MAX_TILT


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
        check_limits(
            self,
            "faults.",
            action_delay=(0.0, 0.5),
            kp_scale=(0.1, 10.0),
            kd_scale=(0.0, 10.0),
            mass_scale=(0.1, 10.0),
            friction_scale=(0.01, 10.0),
            velocity_noise=(0.0, 10.0),
            velocity_bias=(0.0, 10.0),
            imu_noise=(0.0, 10.0),
        )
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


@dataclass(frozen=True)
class OracleConfig:
    """How the shortest-path follower walks.

    Attributes:
        speed: forward speed on a straight path [m/s].
        look_ahead: distance along the path to the point that the robot heads for [m].
        turn_gain: yaw rate for each radian of heading error [1/s].
        turn_rate: largest yaw rate [rad/s] [paper: 60 deg/s].
        turn_in_place: heading error beyond which it stops and turns [rad].
        replan_m: distance from the planned path beyond which a new one is planned [m].
    """

    speed: float = 0.8
    look_ahead: float = 0.6
    turn_gain: float = 1.5
    turn_rate: float = math.pi / 3
    turn_in_place: float = 0.9
    replan_m: float = 0.6

    def __post_init__(self) -> None:
        positive = ("speed", "look_ahead", "turn_gain", "turn_rate", "turn_in_place", "replan_m")
        check_fields(self, "oracle.", positive=positive, fractions=("speed",))


@dataclass(frozen=True)
class EvaluationConfig:
    """The rules of the paper's protocol [paper, IV; ViNL code], and ours where it names none.

    Attributes:
        time_limit: length of an episode [s] [paper code: 250 decisions at 2 Hz].
        success_radius: an episode succeeds when the robot's middle is nearer to the goal than this [m] [paper].
        navigation_period: control steps of 0.02 s between two decisions of the navigator [paper: 2 Hz].
        min_distance: least straight distance from start to goal [m] [paper code].
        clearance: least distance of start and goal to walls and furniture [m] [paper code].
        joint_noise: half-width of the uniform noise on the joint angles at the start [rad].
        max_tilt: a trunk tilted farther than this has fallen [rad].
        stuck_window: a time-out counts as ``stuck`` if over so many last seconds [s] ...
        stuck_distance: ... the robot ended nearer than this to where it was [m].
        ceiling: height of a ceiling that the cameras see [m]; none by default.
        min_metres: episodes shorter than this do not count in the rates per metre [m] [paper: 1 m].
        sensors: errors of the depth cameras of navigator and locomotor, see ``vinl.sensing.sensor_config``.
        odometry: errors of where a learned navigator believes to be; it arrives where the goal is.
        oracle: how the shortest-path follower walks.
        faults: what is wrong with motors, body and state estimate; nothing by default.
    """

    time_limit: float = 125.0
    success_radius: float = 0.325
    navigation_period: int = 25
    min_distance: float = 5.0
    clearance: float = 0.5
    joint_noise: float = 0.05
    max_tilt: float = MAX_TILT
    stuck_window: float = 20.0
    stuck_distance: float = 0.5
    ceiling: float | None = None
    min_metres: float = 1.0
    sensors: SensorConfig = field(default_factory=SensorConfig)
    odometry: OdometryConfig = field(default_factory=OdometryConfig)
    oracle: OracleConfig = field(default_factory=OracleConfig)
    faults: FaultConfig = field(default_factory=FaultConfig)

    def __post_init__(self) -> None:
        check_limits(self, time_limit=(0.02, 3600.0), max_tilt=(0.0, math.pi), ceiling=(1, 100))
        check_fields(
            self,
            counts=("navigation_period",),
            positive=("success_radius", "stuck_window", "min_metres", "max_tilt"),
            unsigned=("min_distance", "clearance", "joint_noise", "stuck_distance"),
        )


def choose_rules(config: EvaluationConfig | None) -> EvaluationConfig:
    """The rules that are given, or the paper's.

    Raises:
        InputError: they are none.
    """
    if config is None:
        return EvaluationConfig()
    if not isinstance(config, EvaluationConfig):
        raise InputError(f"config must be an EvaluationConfig, got {type(config).__name__}; vinl.EvaluationConfig(...)")
    return config
