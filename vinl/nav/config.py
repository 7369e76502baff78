"""One training of the navigator: homes, episodes, camera, execution, reward and learning, as frozen records whose
values live in ``configs/nav/*.yaml``."""

from __future__ import annotations

from dataclasses import dataclass, field

from vinl.config.errors import InputError
from vinl.config.limits import Range, check_fields, check_number, check_range
from vinl.nav.ppo_config import NavNetworkConfig, NavPpoConfig
from vinl.nav.robot_config import ExecutionConfig, MotionConfig, NavCameraConfig, RobotConfig, ViewConfig
from vinl.policies.card import PREVIOUS
from vinl.sensing.odometry_config import OdometryConfig
from vinl.sensing.sensor_config import SensorConfig
from vinl.world.homes.config import HomeConfig, layout_config


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
        check_number("homes.path_radius", self.path_radius, 0.1, 1.0)
        check_number("homes.start_clearance", self.start_clearance, 0.0, 2.0)
        check_number("homes.goal_clearance", self.goal_clearance, 0.0, 2.0)


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
        check_number("episodes.success_radius", self.success_radius, 0.01, 5.0)
        check_number("episodes.success_geodesic", self.success_geodesic, self.success_radius, 50.0)
        check_range("episodes.distance", self.distance, self.success_radius, 1000.0)
        check_range("episodes.start_speed", self.start_speed, 0.0, 1.0)
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
        check_number("clutter.share", self.share, 0.0, 1.0)
        check_range("clutter.density", self.density, 0.0, 10.0)
        check_number("clutter.spacing", self.spacing, 0.0, 10.0)
        check_range("clutter.length", self.length, 0.01, 2.0)
        check_number("clutter.width", self.width, 0.01, 2.0)
        check_range("clutter.height", self.height, 0.01, 0.3)


@dataclass(frozen=True)
class NavRewardConfig:
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
        check_fields(self, "reward.", positive=("scale",))


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
        check_number("num_envs", self.num_envs, 1, 65536)
        check_number("seed", self.seed, 0, 2**31 - 1)
        if self.previous not in PREVIOUS:
            raise InputError(f"previous must be one of {', '.join(PREVIOUS)}, got {self.previous!r}")
        if self.camera is not None and self.camera.missing == "plane" and self.ppo.image_type == "uint8":
            raise InputError("camera.missing=plane needs ppo.image_type=float16: a byte has no room for the mark")
        if self.network.places and self.previous == "action":
            raise InputError("network.places needs previous=motion or both: the map follows the robot's own motion")
