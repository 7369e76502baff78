"""The two depth cameras of the robot, as records that every policy card keeps."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from vinl.config.errors import InputError

MISSING = ("as_is", "fill", "plane")
"""What a policy's preparation does with pixels without a return: it leaves the image as it is, which then reads as the
far limit there; fills them, and what lies beyond the far limit, from their neighbours; or hands their places to the
network as a second plane."""


@dataclass(frozen=True)
class Camera:
    """A depth camera fixed to the trunk. Depth is metres along the optical axis (planar, not along the ray).

    Attributes:
        name: what the camera is for.
        position: of the optical centre in the trunk frame [m].
        pitch_down: angle of the optical axis below the trunk's x axis [rad]; negative looks up.
        hfov: horizontal field of view [rad]; pixels are square, the vertical one follows from the image size.
        width, height: image size [pixels].
        far: what is farther, or nothing hit, reads as this [m], unless it is filled.
        missing: what becomes of pixels without a return before the network, one of ``MISSING``, see
            ``vinl.sensing.preparation``.
    """

    name: str
    position: tuple[float, float, float]
    pitch_down: float
    hfov: float
    width: int
    height: int
    far: float
    missing: str = "as_is"

    def __post_init__(self) -> None:
        if not 0 < self.hfov < math.pi:
            raise InputError(f"camera {self.name}: hfov must lie between 0 and pi rad, got {self.hfov}")
        if self.width < 1 or self.height < 1:
            raise InputError(f"camera {self.name}: image size must be positive, got {self.width} x {self.height}")
        if self.far <= 0:
            raise InputError(f"camera {self.name}: far must be positive, got {self.far}")
        if self.missing not in MISSING:
            raise InputError(f"camera {self.name}: missing must be one of {', '.join(MISSING)}, got {self.missing!r}")

    @property
    def tan_half(self) -> tuple[float, float]:
        """Tangents of half the horizontal and half the vertical field of view."""
        tx = math.tan(self.hfov / 2)
        return tx, tx * self.height / self.width

    def rotation(self) -> np.ndarray:
        """(3, 3) camera to trunk: columns are forward (the optical axis), left and up of the image."""
        c, s = math.cos(self.pitch_down), math.sin(self.pitch_down)
        return np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])

    def normalise(self, depth: Any) -> Any:
        """Depth [m] to [0, 1]: 1 is the far limit and beyond. Works on numpy and torch arrays."""
        return (depth / self.far).clip(0.0, 1.0)

    def describe(self) -> dict[str, Any]:
        """The record as plain data, for policy cards."""
        return asdict(self)


LOCOMOTION_CAMERA = Camera("locomotion", (0.32, 0.0, 0.0), 0.524, 1.92, 96, 56, 2.0)
"""Looks 30 deg down at the ground in front of the feet, 110 x 80 deg wide like the Stereolabs ZED X Mini (lens of
2.2 mm, 0.1 to 8 m); what all shipped locomotion policies with a camera see through. ViNL has it at 0.35 m, where it
looks through a wall that the nose (0.339 m) touches."""

NAVIGATION_CAMERA = Camera("navigation", (0.32, 0.0, 0.0), 0.0, 1.5708, 80, 60, 10.0, "fill")
"""Looks ahead, level and 90 deg wide; what the shipped navigation policy sees through. ViNL's, at 0.35 m, 15 deg up,
70 deg and 320 x 180 pixels, is in the config ``nav/paper``."""
