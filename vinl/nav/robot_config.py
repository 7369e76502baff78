"""The robot of a navigation environment: its body, its camera and how that moves, its images, and how it carries out
what it is commanded (sections ``robot``, ``camera``, ``motion``, ``view`` and ``execution`` of a config)."""

from __future__ import annotations

import math
from dataclasses import dataclass

from vinl.config.errors import InputError
from vinl.config.limits import Range, check_number, check_range
from vinl.robot.cameras import NAVIGATION_CAMERA, Camera

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
        for name in ("length", "width", "max_speed", "max_yaw_rate", "period"):
            check_number(f"robot.{name}", getattr(self, name), 1e-3, 10.0)
        check_number("robot.min_speed", self.min_speed, -10.0, 0.0)
        if self.width > self.length:
            raise InputError("robot.width must not exceed robot.length")


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
        check_number("camera.pitch_down", self.pitch_down, -1.5, 1.5)
        check_number("camera.forward", self.forward, -1.0, 1.0)
        check_number("camera.mount_height", self.mount_height, 0.05, 2.0)

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
        for k, axis in enumerate(("roll", "pitch")):
            check_number(f"motion.tilt ({axis})", self.tilt[k], -1.0, 1.0)
            check_number(f"motion.offset ({axis})", self.offset[k], 0.0, 1.0)
            check_number(f"motion.shake ({axis})", self.shake[k], 0.0, 1.0)
        check_number("motion.uniform", self.uniform, 0.0, 1.0)
        check_number("motion.correlation", self.correlation, 0.0, 0.999)
        check_range("motion.amplitude", self.amplitude, 0.0, 10.0)
        for name in ("height_offset", "height_shake"):
            check_number(f"motion.{name}", getattr(self, name), 0.0, 0.2)


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
        check_number("view.ceiling_share", self.ceiling_share, 0.0, 1.0)
        check_range("view.ceiling", self.ceiling, 1.0, 20.0)


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
        give_way: a step that would touch something is not cancelled as a whole: the robot turns on the spot, and
            what its corners meet pushes it so far back or aside at most [m]; 0: cancelled as a whole [paper].
    """

    lag: float = 0.0
    speed_gain: Range = (1.0, 1.0)
    yaw_gain: Range = (1.0, 1.0)
    speed_noise: float = 0.0
    yaw_noise: float = 0.0
    side_slip: float = 0.0
    yaw_drift: float = 0.0
    amplitude: Range = (1.0, 1.0)
    give_way: float = 0.0

    def __post_init__(self) -> None:
        check_number("execution.lag", self.lag, 0.0, 5.0)
        check_range("execution.speed_gain", self.speed_gain, 0.0, 2.0)
        check_range("execution.yaw_gain", self.yaw_gain, 0.0, 2.0)
        for name in ("speed_noise", "yaw_noise", "side_slip", "yaw_drift"):
            check_number(f"execution.{name}", getattr(self, name), 0.0, 1.0)
        check_range("execution.amplitude", self.amplitude, 0.0, 10.0)
        check_number("execution.give_way", self.give_way, 0.0, 0.5)
