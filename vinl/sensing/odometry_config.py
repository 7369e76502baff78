"""How far dead reckoning is off, as a frozen record."""

from __future__ import annotations

import math
from dataclasses import dataclass

from vinl.config.errors import InputError


@dataclass(frozen=True)
class OdometryConfig:
    """Errors of dead reckoning; the defaults are an exact one [paper].

    Attributes:
        drift: range of the relative error of distances, drawn for an episode; too long or too short alike.
        yaw_bias: the heading is off by up to this times the drift for each metre more, to either side [rad/m]. At 0.1 a
            drift of 2 % turns the robot's idea of its heading by up to 0.11 deg a metre, and after 20 m it is off by
            as much again to the side as along the way.
    """

    drift: tuple[float, float] = (0.0, 0.0)
    yaw_bias: float = 0.1

    def __post_init__(self) -> None:
        low, high = self.drift
        if not (math.isfinite(low) and math.isfinite(high) and 0.0 <= low <= high <= 0.5):
            raise InputError(f"odometry.drift must be a rising range within 0 to 0.5, got {low:g} to {high:g}")
        if not 0.0 <= self.yaw_bias <= 1.0:
            raise InputError(f"odometry.yaw_bias must lie between 0 and 1, got {self.yaw_bias:g}")

    @property
    def is_exact(self) -> bool:
        """Whether robots know where they are."""
        return self.drift[1] == 0.0
