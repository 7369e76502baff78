"""What stage 3 can be told: the student's network, its camera, the errors of that, and how it learns."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

from vinl.config.errors import InputError
from vinl.config.limits import check_fields
from vinl.policies.depth_memory import MEMORIES
from vinl.robot.cameras import LOCOMOTION_CAMERA, Camera
from vinl.sensing.sensor_config import SensorConfig


@dataclass(frozen=True)
class NetworkConfig:
    """The student's estimator of the velocity; planner and actor behind it are the teacher's [paper III-C].

    Attributes:
        hidden, layers: of the memory.
        memory: ``lstm``, or ``mlp`` for plain layers and a map of the newest image alone [paper IV-B].
        remember: at the start the LSTM's cells keep what they hold for 1 to this many control steps, spread evenly;
            0: the paper's start, which forgets within two steps.
    """

    hidden: int = 64
    layers: int = 2
    memory: str = "lstm"
    remember: int = 50

    def __post_init__(self) -> None:
        if self.memory not in MEMORIES:
            raise InputError(f"student.network.memory must be one of {', '.join(MEMORIES)}, got {self.memory!r}")
        check_fields(self, "student.network.", counts=("hidden", "layers"))
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
        """The camera record, as it goes onto the policy card; pixels without a return tell the map nothing."""
        position = (self.forward, *LOCOMOTION_CAMERA.position[1:])
        view = {"hfov": self.hfov, "pitch_down": self.pitch_down, "far": self.far, "missing": "plane"}
        return replace(LOCOMOTION_CAMERA, position=position, width=self.width, height=self.height, **view)


@dataclass(frozen=True)
class DistillationConfig:
    """DAgger: the student walks by what it believes, and is told what was true [paper III-C].

    Attributes:
        steps: control steps of each robot between updates.
        bptt: control steps that gradients flow back through; divides ``steps``. 1 is the paper's.
        epochs, minibatches: passes over a roll-out and parts of each; a part holds all steps of some robots.
        learning_rate, last_learning_rate: of Adam, at the start and at the end; a cosine between them.
        warmup: fraction of the iterations in which the rate rises from zero.
        max_grad_norm: gradients are clipped to this norm.
        teacher_share: fraction of the robots that walk by what is true at the start; 0 is the paper's.
        teacher_until: fraction of the iterations after which none does.
    """

    steps: int = 24
    bptt: int = 24
    epochs: int = 2
    minibatches: int = 8
    learning_rate: float = 1e-3
    last_learning_rate: float = 3e-5
    warmup: float = 0.01
    max_grad_norm: float = 1.0
    teacher_share: float = 1.0
    teacher_until: float = 0.04

    def __post_init__(self) -> None:
        check_fields(
            self,
            "student.distillation.",
            counts=("steps", "bptt", "epochs", "minibatches"),
            positive=("last_learning_rate", "max_grad_norm"),
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
    """Stage 3: the settings that the other stages do not have; ``sensors`` are the errors of the camera."""

    network: NetworkConfig = field(default_factory=NetworkConfig)
    camera: CameraConfig = field(default_factory=CameraConfig)
    sensors: SensorConfig = field(default_factory=SensorConfig)
    distillation: DistillationConfig = field(default_factory=DistillationConfig)
