"""What stage 3 can be told: the student's network, its camera, what is random about that, and how it learns."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

from vinl.config.errors import InputError
from vinl.config.limits import check_fields, check_range
from vinl.policies.depth_memory import MEMORIES, VISIONS
from vinl.policies.stepping_actor import CODES
from vinl.robot.cameras import LOCOMOTION_CAMERA, Camera

HOLES = ("far", "zero")

MAX_DELAY = 0.04
"""An image comes at most this late [s]: two control steps."""


@dataclass(frozen=True)
class NetworkConfig:
    """The student's network; planner and actor behind it are the teacher's [paper III-C].

    Attributes:
        vision: ``cnn``, ``resnet18`` or ``none`` (blind, but with memory).
        visual: numbers that the image becomes.
        hidden, layers: of the memory.
        memory: ``lstm``, or ``mlp`` for plain layers without memory [paper IV-B].
        planes: channels of the first stage of ``resnet18``.
        remember: at the start the LSTM's cells keep what they hold for 1 to this many control steps, spread evenly;
            0: the paper's start, which forgets within two steps.
        code: what is predicted of the ground: ``plan`` (the foothold plan) or ``map`` (heights about the robot, which
            the planner reads).
    """

    vision: str = "cnn"
    visual: int = 32
    hidden: int = 64
    layers: int = 2
    memory: str = "lstm"
    planes: int = 32
    remember: int = 50
    code: str = "map"

    def __post_init__(self) -> None:
        if self.vision not in VISIONS:
            raise InputError(f"student.network.vision must be one of {', '.join(VISIONS)}, got {self.vision!r}")
        if self.memory not in MEMORIES:
            raise InputError(f"student.network.memory must be one of {', '.join(MEMORIES)}, got {self.memory!r}")
        check_fields(self, "student.network.", counts=("visual", "hidden", "layers", "planes"))
        if self.planes % 16:
            raise InputError(f"student.network.planes must be a multiple of 16, got {self.planes}")
        if self.code not in CODES:
            raise InputError(f"student.network.code must be one of {', '.join(CODES)}, got {self.code!r}")
        if self.remember < 0 or self.remember == 1:
            raise InputError(f"student.network.remember must be 0 or at least 2, got {self.remember}")


@dataclass(frozen=True)
class CameraConfig:
    """The student's camera: ``LOCOMOTION_CAMERA`` with another image.

    Attributes:
        forward: of the optical centre, ahead of the trunk's middle [m]. The trunk ends at 0.339 m: a camera ahead of
            that looks through a wall that the trunk touches.
        width, height: of the image [pixels].
        hfov: horizontal field of view [rad]; pixels are square.
        pitch_down: of the optical axis [rad].
        far: what is farther reads as this [m].
    """

    forward: float = LOCOMOTION_CAMERA.position[0]
    width: int = LOCOMOTION_CAMERA.width
    height: int = LOCOMOTION_CAMERA.height
    hfov: float = LOCOMOTION_CAMERA.hfov
    pitch_down: float = LOCOMOTION_CAMERA.pitch_down
    far: float = LOCOMOTION_CAMERA.far

    def __post_init__(self) -> None:
        self.record()
        if min(self.width, self.height) < 16:
            raise InputError(f"student.camera: at least 16 x 16 pixels, got {self.width} x {self.height}")

    def record(self) -> Camera:
        """The camera record, as it goes onto the policy card."""
        position = (self.forward, *LOCOMOTION_CAMERA.position[1:])
        view = {"hfov": self.hfov, "pitch_down": self.pitch_down, "far": self.far}
        return replace(LOCOMOTION_CAMERA, position=position, width=self.width, height=self.height, **view)


@dataclass(frozen=True)
class SightConfig:
    """What differs between what the camera record says and what the student sees; drawn anew for every episode.

    Attributes:
        position: largest offset of the camera along each axis [m].
        angle: largest error of its roll, pitch and yaw [rad].
        zoom: largest relative error of the tangent of half the field of view.
        scale: largest relative error of all depths of an image.
        noise: standard deviation of each pixel's depth, as a fraction of the depth.
        holes: largest fraction of the image that is missing; each episode draws its own up to this.
        hole_size: side of the squares that are missing [pixels].
        hole_reads: what a missing pixel reads: ``far`` or ``zero``.
        delay: range of the time by which every image of an episode is late [s], up to 0.04; in control steps, to the
            nearest.
    """

    position: float = 0.01
    angle: float = math.radians(2.0)
    zoom: float = 0.02
    scale: float = 0.02
    noise: float = 0.01
    holes: float = 0.04
    hole_size: int = 4
    hole_reads: str = "far"
    delay: tuple[float, float] = (0.0, 0.04)

    def __post_init__(self) -> None:
        sizes, fractions = ("position", "angle", "noise"), ("zoom", "scale", "holes")
        check_fields(self, "student.sight.", unsigned=sizes, fractions=fractions, counts=("hole_size",))
        check_range("student.sight.delay", self.delay, 0.0, MAX_DELAY)
        if self.hole_reads not in HOLES:
            raise InputError(f"student.sight.hole_reads must be one of {', '.join(HOLES)}, got {self.hole_reads!r}")


@dataclass(frozen=True)
class DistillationConfig:
    """DAgger: the student walks by what it predicts, and is told what was true [paper III-C].

    Attributes:
        steps: control steps of each robot between updates.
        bptt: control steps that gradients flow back through; divides ``steps``. 1 is the paper's.
        epochs, minibatches: passes over a roll-out and parts of each; a part holds all steps of some robots.
        velocity_weight, code_weight: of the errors of the velocity and of the code.
        learning_rate, last_learning_rate: of Adam, at the start and at the end; a cosine between them.
        warmup: fraction of the iterations in which the rate rises from zero.
        max_grad_norm: gradients are clipped to this norm.
        teacher_share: fraction of the robots that walk by what is true at the start; 0 is the paper's.
        teacher_until: fraction of the iterations after which none does.
        bfloat16: the convolutions in bfloat16 on a GPU.
    """

    steps: int = 24
    bptt: int = 24
    epochs: int = 2
    minibatches: int = 8
    velocity_weight: float = 1.0
    code_weight: float = 1.0
    learning_rate: float = 1e-3
    last_learning_rate: float = 3e-5
    warmup: float = 0.01
    max_grad_norm: float = 1.0
    teacher_share: float = 1.0
    teacher_until: float = 0.04
    bfloat16: bool = True

    def __post_init__(self) -> None:
        check_fields(
            self,
            "student.distillation.",
            counts=("steps", "bptt", "epochs", "minibatches"),
            positive=("last_learning_rate", "max_grad_norm"),
            unsigned=("velocity_weight", "code_weight"),
            fractions=("teacher_share", "teacher_until", "warmup"),
        )
        if self.steps % self.bptt:
            raise InputError(f"student.distillation.bptt must divide steps {self.steps}, got {self.bptt}")
        if self.last_learning_rate > self.learning_rate:
            raise InputError("student.distillation: need last_learning_rate <= learning_rate")

    def rate_at(self, fraction: float) -> float:
        """The learning rate after a fraction of the iterations."""
        rise = min((fraction + 1e-3) / self.warmup, 1.0) if self.warmup > 0 else 1.0
        wave = 0.5 * (1 + math.cos(math.pi * min(fraction, 1.0)))
        return rise * (self.last_learning_rate + wave * (self.learning_rate - self.last_learning_rate))

    def teacher_fraction_at(self, fraction: float) -> float:
        """The fraction of robots that the teacher drives after a fraction of the iterations."""
        return self.teacher_share * max(1 - fraction / self.teacher_until, 0.0) if self.teacher_until > 0 else 0.0


@dataclass(frozen=True)
class StudentConfig:
    """Stage 3: the settings that the other stages do not have."""

    network: NetworkConfig = field(default_factory=NetworkConfig)
    camera: CameraConfig = field(default_factory=CameraConfig)
    sight: SightConfig = field(default_factory=SightConfig)
    distillation: DistillationConfig = field(default_factory=DistillationConfig)
