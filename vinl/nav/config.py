"""One training of the navigator: homes, episodes, camera, execution, reward and learning, as frozen records whose
values live in ``configs/nav/*.yaml``."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from vinl.config.errors import InputError
from vinl.nav.ppo_config import NetworkConfig, PpoConfig
from vinl.policies.card import PREVIOUS
from vinl.robot.cameras import Camera
from vinl.world.homes.config import HomeConfig

Range = tuple[float, float]
Pair = tuple[float, float]


def _check_range(name: str, value: Range, least: float = -math.inf, most: float = math.inf) -> None:
    if not (math.isfinite(value[0]) and math.isfinite(value[1]) and least <= value[0] <= value[1] <= most):
        raise InputError(
            f"{name} must be a rising range within {least:g} to {most:g}, got {value[0]:g} to {value[1]:g}"
        )


def _check_number(name: str, value: float, least: float = 0.0, most: float = math.inf) -> None:
    if not (math.isfinite(value) and least <= value <= most):
        raise InputError(f"{name} must lie between {least:g} and {most:g}, got {value:g}")


@dataclass(frozen=True)
class HomesConfig:
    """Which homes there are; home k is drawn from seed ``seed + k`` alone, whatever machine builds it.

    Attributes:
        count: homes at one time.
        seed: of the first home; with ``fresh`` above 0, later seeds follow.
        generator: what generated homes are like.
        plans: floor-plan files or names to train in beside the generated homes, see ``vinl.world.readers``; a range
            of a JSON file's plans as ``FILE:0-49``.
        plans_share: share of the homes that are made from ``plans``, each time with other goals and starts.
        goals: goals in each home, each with a distance field.
        starts: spots in each home that starts are drawn from.
        path_radius: ways to the goal keep this distance from walls and furniture [m] [paper: agent radius 0.22].
        start_clearance, goal_clearance: starts and goals keep this distance from walls and furniture [m].
        fresh: share of the homes that is replaced by fresh ones in 1,000 steps of every robot; 0: never.
        workers: processes that build homes; null: one for each core but one. 0: none, all is built in place.
    """

    count: int = 1000
    seed: int = 1
    generator: HomeConfig = field(default_factory=HomeConfig)
    plans: tuple[str, ...] = ()
    plans_share: float = 0.0
    goals: int = 16
    starts: int = 512
    path_radius: float = 0.22
    start_clearance: float = 0.3
    goal_clearance: float = 0.3
    fresh: float = 0.0
    workers: int | None = None

    def __post_init__(self) -> None:
        for name in ("count", "goals", "starts"):
            if getattr(self, name) < 1:
                raise InputError(f"homes.{name} must be at least 1, got {getattr(self, name)}")
        if self.seed < 0:
            raise InputError(f"homes.seed must not be negative, got {self.seed}")
        _check_number("homes.plans_share", self.plans_share, 0.0, 1.0)
        if self.plans_share > 0 and not self.plans:
            raise InputError("homes.plans_share is above 0, but homes.plans names no floor plan")
        _check_number("homes.path_radius", self.path_radius, 0.1, 1.0)
        _check_number("homes.start_clearance", self.start_clearance, 0.0, 2.0)
        _check_number("homes.goal_clearance", self.goal_clearance, 0.0, 2.0)
        _check_number("homes.fresh", self.fresh)
        if self.workers is not None and self.workers < 0:
            raise InputError(f"homes.workers must not be negative, got {self.workers}")


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
        _check_number("episodes.success_radius", self.success_radius, 0.01, 5.0)
        _check_number("episodes.success_geodesic", self.success_geodesic, self.success_radius, 50.0)
        _check_range("episodes.distance", self.distance, self.success_radius, 1000.0)
        _check_range("episodes.start_speed", self.start_speed, 0.0, 1.0)
        if self.steps < 1:
            raise InputError(f"episodes.steps must be at least 1, got {self.steps}")


@dataclass(frozen=True)
class RobotConfig:
    """What moves.

    Attributes:
        length, width: of the rectangle that must not touch anything [m] [facts: 0.65 x 0.31].
        max_speed: forward speed of action 1; action -1 stands still [m/s].
        max_yaw_rate: yaw rate of action 1 [rad/s].
        period: an action holds so long [s].
    """

    length: float = 0.65
    width: float = 0.31
    max_speed: float = 1.0
    max_yaw_rate: float = math.pi / 3
    period: float = 0.5

    def __post_init__(self) -> None:
        for name in ("length", "width", "max_speed", "max_yaw_rate", "period"):
            _check_number(f"robot.{name}", getattr(self, name), 1e-3, 10.0)
        if self.width > self.length:
            raise InputError("robot.width must not exceed robot.length")


@dataclass(frozen=True)
class CameraConfig:
    """The depth camera in its resting pose.

    Attributes:
        pitch_down: optical axis below the horizontal [rad]; negative looks up.
        hfov: horizontal field of view [rad].
        width, height: image size [pixels].
        far: farther, or nothing hit, reads as this, which is 1 in the normalised image [m].
        forward: the camera is so far ahead of the robot's middle [m].
        mount_height: of the camera above the floor when the robot stands [m].
    """

    pitch_down: float = 0.0
    hfov: float = math.pi / 2
    width: int = 80
    height: int = 60
    far: float = 10.0
    forward: float = 0.35
    mount_height: float = 0.36

    def __post_init__(self) -> None:
        self.record()
        _check_number("camera.pitch_down", self.pitch_down, -1.5, 1.5)
        _check_number("camera.forward", self.forward, -1.0, 1.0)
        _check_number("camera.mount_height", self.mount_height, 0.05, 2.0)

    def record(self) -> Camera:
        """The camera fixed to the trunk, as policy cards keep it."""
        return Camera(
            "navigation", (self.forward, 0.0, 0.0), self.pitch_down, self.hfov, self.width, self.height, self.far
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
        for k, axis in enumerate(("roll", "pitch")):
            _check_number(f"motion.tilt ({axis})", self.tilt[k], -1.0, 1.0)
            _check_number(f"motion.offset ({axis})", self.offset[k], 0.0, 1.0)
            _check_number(f"motion.shake ({axis})", self.shake[k], 0.0, 1.0)
        _check_number("motion.uniform", self.uniform, 0.0, 1.0)
        _check_number("motion.correlation", self.correlation, 0.0, 0.999)
        _check_range("motion.amplitude", self.amplitude, 0.0, 10.0)
        for name in ("height_offset", "height_shake"):
            _check_number(f"motion.{name}", getattr(self, name), 0.0, 0.2)


@dataclass(frozen=True)
class ExecutionConfig:
    """How the robot carries out a velocity; the defaults are perfect [paper].

    Attributes:
        lag: the velocity approaches the commanded one with this time constant [s].
        speed_gain, yaw_gain: ranges of a factor of an episode on forward speed and yaw rate.
        speed_noise, yaw_noise: standard deviation of a step's mean forward speed [m/s] and yaw rate [rad/s], for a
            robot at full speed; less in proportion when slower or turning less (half of it when it stands).
        side_slip: standard deviation of a step's mean sideways speed [m/s], in proportion to the forward speed.
        yaw_drift: yaw rate of an episode when walking at full speed, uniform within +- this [rad/s].
        amplitude: range of a factor of an episode on the noises and the slip, uniform; 0 is sure of foot.
    """

    lag: float = 0.0
    speed_gain: Range = (1.0, 1.0)
    yaw_gain: Range = (1.0, 1.0)
    speed_noise: float = 0.0
    yaw_noise: float = 0.0
    side_slip: float = 0.0
    yaw_drift: float = 0.0
    amplitude: Range = (1.0, 1.0)

    def __post_init__(self) -> None:
        _check_number("execution.lag", self.lag, 0.0, 5.0)
        _check_range("execution.speed_gain", self.speed_gain, 0.0, 2.0)
        _check_range("execution.yaw_gain", self.yaw_gain, 0.0, 2.0)
        for name in ("speed_noise", "yaw_noise", "side_slip", "yaw_drift"):
            _check_number(f"execution.{name}", getattr(self, name), 0.0, 1.0)
        _check_range("execution.amplitude", self.amplitude, 0.0, 10.0)


@dataclass(frozen=True)
class ClutterConfig:
    """Blocks on the floor that the camera sees and that the robot steps over: they never stop it.

    Attributes:
        share: share of the homes with blocks.
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
        _check_number("clutter.share", self.share, 0.0, 1.0)
        _check_range("clutter.density", self.density, 0.0, 10.0)
        _check_number("clutter.spacing", self.spacing, 0.0, 10.0)
        _check_range("clutter.length", self.length, 0.01, 2.0)
        _check_number("clutter.width", self.width, 0.01, 2.0)
        _check_range("clutter.height", self.height, 0.01, 0.3)


@dataclass(frozen=True)
class ViewConfig:
    """What else differs in the images.

    Attributes:
        ceiling_share: share of the episodes with a ceiling.
        ceiling: range of its height [m].
        noise: standard deviation of a pixel's depth, as a share of the depth.
        dropout: largest share of the pixels that read as the far limit; uniform from 0 for each image.
    """

    ceiling_share: float = 0.6
    ceiling: Range = (2.4, 3.4)
    noise: float = 0.0
    dropout: float = 0.0

    def __post_init__(self) -> None:
        _check_number("view.ceiling_share", self.ceiling_share, 0.0, 1.0)
        _check_range("view.ceiling", self.ceiling, 1.0, 20.0)
        _check_number("view.noise", self.noise, 0.0, 1.0)
        _check_number("view.dropout", self.dropout, 0.0, 1.0)


@dataclass(frozen=True)
class RewardConfig:
    """Reward of a step [facts/navigation 1.1, column A].

    Attributes:
        success: once, at the goal.
        progress: for each metre that the geodesic distance shrinks.
        slack: every step.
        collision: every step that is cancelled because the robot would touch something.
        scale: multiplies the sum.
    """

    success: float = 10.0
    progress: float = 1.0
    slack: float = -0.002
    collision: float = -0.003
    scale: float = 1.0

    def __post_init__(self) -> None:
        if self.scale <= 0:
            raise InputError(f"reward.scale must be positive, got {self.scale}")


@dataclass(frozen=True)
class NavConfig:
    """One navigation environment, and the training in it.

    Attributes:
        num_envs: robots in parallel; on each device, where there are several.
        iterations: updates of a training.
        seed: of everything random but the homes.
        previous: what a robot knows of its last step: the ``action`` that it asked for [paper], its ``motion`` in the
            same units, (-1, 0) where the step was cancelled, or ``both``.
        camera: null: the robot is blind.
    """

    num_envs: int = 4096
    iterations: int = 1000
    seed: int = 1
    previous: str = "both"
    homes: HomesConfig = field(default_factory=HomesConfig)
    episodes: EpisodeConfig = field(default_factory=EpisodeConfig)
    robot: RobotConfig = field(default_factory=RobotConfig)
    camera: CameraConfig | None = field(default_factory=CameraConfig)
    motion: MotionConfig = field(default_factory=MotionConfig)
    execution: ExecutionConfig = field(default_factory=ExecutionConfig)
    clutter: ClutterConfig = field(default_factory=ClutterConfig)
    view: ViewConfig = field(default_factory=ViewConfig)
    reward: RewardConfig = field(default_factory=RewardConfig)
    network: NetworkConfig = field(default_factory=NetworkConfig)
    ppo: PpoConfig = field(default_factory=PpoConfig)

    def __post_init__(self) -> None:
        if self.iterations < 1:
            raise InputError(f"iterations must be at least 1, got {self.iterations}")
        if not 1 <= self.num_envs <= 65536:
            raise InputError(f"num_envs must lie between 1 and 65536, got {self.num_envs}")
        if self.previous not in PREVIOUS:
            raise InputError(f"previous must be one of {', '.join(PREVIOUS)}, got {self.previous!r}")
        if not 0 <= self.seed < 2**31:
            raise InputError(f"seed must lie between 0 and 2147483647, got {self.seed}")
