"""The rules of an evaluation: limits of an episode, what counts as an end, how the oracle walks."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from vinl.chain.fault_config import FaultConfig
from vinl.config.errors import InputError
from vinl.config.limits import check_fields, check_number
from vinl.sensing.odometry_config import OdometryConfig
from vinl.sensing.sensor_config import SensorConfig
from vinl.world.endings import MAX_TILT


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
        check_number("time_limit", self.time_limit, 0.02, 3600.0)
        check_number("max_tilt", self.max_tilt, 0.0, math.pi)
        check_fields(
            self,
            counts=("navigation_period",),
            positive=("success_radius", "stuck_window", "min_metres", "max_tilt"),
            unsigned=("min_distance", "clearance", "joint_noise", "stuck_distance"),
        )
        if self.ceiling is not None and not 1 <= self.ceiling <= 100:
            raise InputError(f"ceiling must lie between 1 and 100 m, got {self.ceiling}; null for none")
