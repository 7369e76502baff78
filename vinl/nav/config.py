"""One training of the navigator: homes, episodes, camera, execution and reward, as frozen records whose values live in
``configs/nav/*.yaml``. Network and learning: ``vinl.nav.learning_config``."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from vinl.config.errors import InputError
from vinl.config.limits import Range, check_fields, check_limits, check_number
from vinl.nav.learning_config import NavNetworkConfig, NavPpoConfig
from vinl.policies.card import PREVIOUS
from vinl.policies.velocity_range import VelocityRange
from vinl.robot.cameras import NAVIGATION_CAMERA, Camera
from vinl.sensing.sensor_config import OdometryConfig, SensorConfig
from vinl.world.homes.config import HomeConfig, layout_config

Pair = tuple[float, float]
"""Of roll and of pitch."""


@dataclass(frozen=True)
class RobotConfig:
    """What moves.

    Attributes:
        length, width: of the rectangle that must not touch anything [m] [facts: 0.65 x 0.31].
        min_speed: forward speed of action -1 [m/s]; 0: there is no way back; negative: it walks backwards, unseen.
        max_speed: forward speed of action 1 [m/s].
        max_yaw_rate: yaw rate of action 1 [rad/s].
        period: an action holds so long [s].
    """

    length: float = 0.65
    width: float = 0.31
    min_speed: float = 0.0
    max_speed: float = 1.0
    max_yaw_rate: float = math.pi / 3
    period: float = 0.5

    def __post_init__(self) -> None:
        positive = dict.fromkeys(("length", "width", "max_speed", "max_yaw_rate", "period"), (1e-3, 10.0))
        check_limits(self, "robot.", **positive, min_speed=(-10.0, 0.0))
        if self.width > self.length:
            raise InputError("robot.width must not exceed robot.length")

    @property
    def velocity_range(self) -> VelocityRange:
        """What actions mean."""
        return VelocityRange((self.min_speed, self.max_speed), (-self.max_yaw_rate, self.max_yaw_rate))


@dataclass(frozen=True)
class NavCameraConfig:
    """The depth camera in its resting pose.

    Attributes:
        pitch_down: optical axis below the horizontal [rad]; negative looks up.
        hfov: horizontal field of view [rad].
        width, height: image size [pixels].
        far: farther, or nothing hit, reads as this, which is 1 in the normalised image [m].
        forward: the camera is so far ahead of the robot's middle [m].
        mount_height: of the camera above the floor when the robot stands [m].
        missing: what becomes of pixels without a return before the network: ``fill``, ``plane`` or ``as_is``, see
            ``vinl.robot.cameras.MISSING``.
    """

    pitch_down: float = NAVIGATION_CAMERA.pitch_down
    hfov: float = NAVIGATION_CAMERA.hfov
    width: int = NAVIGATION_CAMERA.width
    height: int = NAVIGATION_CAMERA.height
    far: float = NAVIGATION_CAMERA.far
    forward: float = NAVIGATION_CAMERA.position[0]
    mount_height: float = 0.36
    missing: str = NAVIGATION_CAMERA.missing

    def __post_init__(self) -> None:
        self.record()
        check_limits(self, "camera.", pitch_down=(-1.5, 1.5), forward=(-1.0, 1.0), mount_height=(0.05, 2.0))

    def record(self) -> Camera:
        """The camera fixed to the trunk, as policy cards keep it."""
        return Camera(
            "navigation",
            (self.forward, 0.0, 0.0),
            self.pitch_down,
            self.hfov,
            self.width,
            self.height,
            self.far,
            self.missing,
        )


@dataclass(frozen=True)
class MotionConfig:
    """How the camera moves against its resting pose; pairs are roll (right side down is positive) and pitch (nose down
    is positive).

    Attributes:
        tilt: mean roll and pitch of the walking trunk [rad].
        offset: what an episode adds to them, uniform within +- this [rad].
        shake: standard deviation of the motion within an episode, normal [rad].
        correlation: of the motion within an episode (height too) from one step of 0.5 s to the next; 0: each step is
            drawn anew.
        amplitude: range of a factor of an episode on ``shake`` and ``height_shake``, uniform; 0 is a steady trunk.
        uniform: roll and pitch drawn anew each step, each uniform within +- this [rad] [paper: 30 deg].
        height_offset: height of an episode, uniform within +- this [m].
        height_shake: standard deviation of the height within an episode [m].
        with_trunk: roll and pitch turn the trunk, so that the camera ahead of it goes up and down; otherwise the camera
            turns about itself [paper].
    """

    tilt: Pair = (0.0, 0.0)
    offset: Pair = (0.0, 0.0)
    shake: Pair = (0.0, 0.0)
    correlation: float = 0.0
    amplitude: Range = (1.0, 1.0)
    uniform: float = 0.0
    height_offset: float = 0.0
    height_shake: float = 0.0
    with_trunk: bool = True

    def __post_init__(self) -> None:
        for name, least in (("tilt", -1.0), ("offset", 0.0), ("shake", 0.0)):
            for axis, value in zip(("roll", "pitch"), getattr(self, name), strict=True):
                check_number(f"motion.{name} ({axis})", value, least, 1.0)
        heights = dict.fromkeys(("height_offset", "height_shake"), (0.0, 0.2))
        check_limits(self, "motion.", uniform=(0, 1), correlation=(0.0, 0.999), amplitude=(0, 10), **heights)


@dataclass(frozen=True)
class ViewConfig:
    """What else differs in the images.

    Attributes:
        ceiling_share: fraction of the episodes with a ceiling.
        ceiling: range of its height [m].
    """

    ceiling_share: float = 0.6
    ceiling: Range = (2.4, 3.4)

    def __post_init__(self) -> None:
        check_limits(self, "view.", ceiling_share=(0, 1), ceiling=(1, 20))


@dataclass(frozen=True)
class ExecutionConfig:
    """How the robot carries out a velocity; the defaults are perfect [paper].

    Attributes:
        speed_lag, yaw_lag: forward speed and yaw rate approach the commanded ones with these time constants [s].
        speed_gain, yaw_gain: ranges of a factor of an episode on forward speed and yaw rate.
        speed_noise, yaw_noise: standard deviation of a step's mean forward speed [m/s] and yaw rate [rad/s], for a
            robot at full speed; less in proportion when slower or turning less (half of it when it stands).
        side_slip: standard deviation of a step's mean sideways speed [m/s], in proportion to the forward speed.
        stopped_noise: standard deviation of the forward speed that a robot measures whose step was cancelled [m/s]:
            legs that push against a wall sway.
        yaw_drift: yaw rate of an episode when walking at full speed, uniform within +- this [rad/s].
        amplitude: range of a factor of an episode on the noises and the slip, uniform; 0 is sure of foot.
        give_way: a step that would touch something is not cancelled as a whole: the robot turns on the spot, and
            what its corners meet pushes it so far back or aside at most [m]; 0: cancelled as a whole [paper].
        held_share: fraction of the episodes in which it is cancelled as a whole all the same.
    """

    speed_lag: float = 0.0
    yaw_lag: float = 0.0
    speed_gain: Range = (1.0, 1.0)
    yaw_gain: Range = (1.0, 1.0)
    speed_noise: float = 0.0
    yaw_noise: float = 0.0
    side_slip: float = 0.0
    stopped_noise: float = 0.0
    yaw_drift: float = 0.0
    amplitude: Range = (1.0, 1.0)
    give_way: float = 0.0
    held_share: float = 0.0

    def __post_init__(self) -> None:
        unit = dict.fromkeys(("speed_noise", "yaw_noise", "side_slip", "stopped_noise", "yaw_drift"), (0, 1))
        lags, gains = dict.fromkeys(("speed_lag", "yaw_lag"), (0, 5)), dict.fromkeys(("speed_gain", "yaw_gain"), (0, 2))
        check_limits(
            self, "execution.", **lags, **gains, **unit, amplitude=(0, 10), give_way=(0, 0.5), held_share=(0, 1)
        )


@dataclass(frozen=True)
class HomesConfig:
    """Which homes there are; home k is drawn from seed ``seed + k`` alone, whatever machine builds it.

    Attributes:
        count: homes at one time.
        seed: of the first home.
        generator: what generated homes are like.
        plans: floor-plan files or names to train in beside the generated homes, see ``vinl.world.readers``; a range
            of a JSON file's plans as ``FILE:0-49``.
        layouts: fraction of the generated homes of each other layout, such as ``office: 0.2``; the rest are as
            ``generator`` has it. See ``vinl.world.homes.config.layout_config``.
        plans_share: fraction of the homes that are made from ``plans``, each time with other goals and starts.
        goals: goals in each home, each with a distance field.
        starts: spots in each home that starts are drawn from.
        path_radius: paths to the goal keep this distance from walls and furniture [m] [paper: agent radius 0.22].
        start_clearance, goal_clearance: starts and goals keep this distance from walls and furniture [m].
        workers: processes that build homes; null: one for each core but one. 0: none, all is built in place.
    """

    count: int = 1000
    seed: int = 1
    generator: HomeConfig = field(default_factory=HomeConfig)
    layouts: dict[str, float] = field(default_factory=dict)
    plans: tuple[str, ...] = ()
    plans_share: float = 0.0
    goals: int = 16
    starts: int = 512
    path_radius: float = 0.22
    start_clearance: float = 0.3
    goal_clearance: float = 0.3
    workers: int | None = None

    def __post_init__(self) -> None:
        counts, unsigned = ("count", "goals", "starts"), ("seed", "workers")
        check_fields(self, "homes.", counts=counts, unsigned=unsigned, fractions=("plans_share",))
        for layout, fraction in self.layouts.items():
            layout_config(layout, self.generator)
            check_number(f"homes.layouts.{layout}", fraction, 0.0, 1.0)
        if sum(self.layouts.values()) > 1.0:
            raise InputError(f"homes.layouts must not sum to more than 1, got {sum(self.layouts.values()):g}")
        if self.plans_share > 0 and not self.plans:
            raise InputError("homes.plans_share is above 0, but homes.plans names no floor plan")
        check_limits(self, "homes.", path_radius=(0.1, 1.0), start_clearance=(0, 2), goal_clearance=(0, 2))


@dataclass(frozen=True)
class EpisodeConfig:
    """How an episode begins and ends.

    Attributes:
        distance: range of the geodesic distance at the start [m] [habitat: 1-30].
        steps: an episode ends after so many steps of 0.5 s [Spot's navigator: 150].
        success_radius: straight distance to the goal that ends the episode with success [m] [paper: half the body].
        success_geodesic: a goal nearer than ``success_radius`` but farther than this on foot lies behind a wall [m].
        start_speed: range of the forward speed at the start [m/s].
    """

    distance: Range = (1.0, 30.0)
    steps: int = 150
    success_radius: float = 0.325
    success_geodesic: float = 0.7
    start_speed: Range = (0.0, 0.0)

    def __post_init__(self) -> None:
        radius = self.success_radius
        check_limits(self, "episodes.", success_radius=(0.01, 5.0), success_geodesic=(radius, 50.0))
        check_limits(self, "episodes.", distance=(radius, 1000.0), start_speed=(0, 1))
        check_fields(self, "episodes.", counts=("steps",))


@dataclass(frozen=True)
class ClutterConfig:
    """Blocks on the floor that the camera sees and that the robot steps over: they never stop it.

    Attributes:
        share: fraction of the homes with blocks.
        density: range of blocks for each m2 of free floor, drawn for each home.
        spacing: least distance between two blocks' centres [m].
        length: range of the long side [m].
        width: the other side [m].
        height: range of the height [m].
    """

    share: float = 0.0
    density: Range = (0.2, 1.2)
    spacing: float = 0.5
    length: Range = (0.2, 0.5)
    width: float = 0.2
    height: Range = (0.1, 0.2)

    def __post_init__(self) -> None:
        sizes = {"length": (0.01, 2.0), "width": (0.01, 2.0), "height": (0.01, 0.3)}
        check_limits(self, "clutter.", share=(0, 1), density=(0, 10), spacing=(0, 10), **sizes)


@dataclass(frozen=True)
class NavRewardConfig:
    """Reward of a step [facts/navigation 1.1, column A].

    Attributes:
        success: once, at the goal.
        progress: for each metre that the geodesic distance shrinks.
        path: for each metre moved.
        slack: every step.
        collision: every step that is cancelled because the robot would touch something.
        near: every step that ends with a wall or furniture within ``margin`` of the rectangle: feet swing beside and
            ahead of the trunk, and what they meet throws the robot.
        margin: see ``near`` [m].
        scale: multiplies the sum.
    """

    success: float = 10.0
    progress: float = 1.0
    path: float = 0.0
    slack: float = -0.002
    collision: float = -0.003
    near: float = 0.0
    margin: float = 0.12
    scale: float = 1.0

    def __post_init__(self) -> None:
        check_fields(self, "reward.", positive=("scale",))
        check_limits(self, "reward.", margin=(0.0, 0.15))


@dataclass(frozen=True)
class NavConfig:
    """One navigation environment, and the training in it.

    Attributes:
        num_envs: robots in parallel; on each device, where there are several.
        iterations: updates of a training.
        seed: of everything random but the homes.
        previous: what a robot knows of its last step: the ``action`` that it asked for [paper], its ``motion`` in the
            same units, (-1, 0) where the step was cancelled, ``both``, or ``step``: the action, and how far it came by
            odometry.
        camera: null: the robot is blind.
        sensors: errors of the camera.
        odometry: errors of where the robot believes to be: distance and bearing of the goal follow from that. An
            episode ends, and is rewarded, by where it is.
    """

    num_envs: int = 4096
    iterations: int = 1000
    seed: int = 1
    previous: str = "both"
    homes: HomesConfig = field(default_factory=HomesConfig)
    episodes: EpisodeConfig = field(default_factory=EpisodeConfig)
    robot: RobotConfig = field(default_factory=RobotConfig)
    camera: NavCameraConfig | None = field(default_factory=NavCameraConfig)
    sensors: SensorConfig = field(default_factory=SensorConfig)
    odometry: OdometryConfig = field(default_factory=OdometryConfig)
    motion: MotionConfig = field(default_factory=MotionConfig)
    execution: ExecutionConfig = field(default_factory=ExecutionConfig)
    clutter: ClutterConfig = field(default_factory=ClutterConfig)
    view: ViewConfig = field(default_factory=ViewConfig)
    reward: NavRewardConfig = field(default_factory=NavRewardConfig)
    network: NavNetworkConfig = field(default_factory=NavNetworkConfig)
    ppo: NavPpoConfig = field(default_factory=NavPpoConfig)

    def __post_init__(self) -> None:
        check_fields(self, counts=("iterations",))
        check_limits(self, num_envs=(1, 65536), seed=(0, 2**31 - 1))
        if self.previous not in PREVIOUS:
            raise InputError(f"previous must be one of {', '.join(PREVIOUS)}, got {self.previous!r}")
        if self.network.grid and (self.camera is None or self.previous != "step"):
            raise InputError(
                "network.grid needs a camera and previous=step: a grid is kept up from images and odometry"
            )
        if self.camera is not None and self.camera.missing == "plane" and self.ppo.image_type == "uint8":
            raise InputError("camera.missing=plane needs ppo.image_type=float16: a byte has no room for the mark")
