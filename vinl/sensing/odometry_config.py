"""How far dead reckoning is off, as a frozen record."""

from __future__ import annotations

from dataclasses import dataclass

from vinl.config.limits import Range, check_number, check_range


@dataclass(frozen=True)
class OdometryConfig:
    """Errors of dead reckoning; the defaults are an exact one [paper].

    Attributes:
        drift: range of the relative error of distances, drawn for an episode; too long or too short alike.
        yaw_bias: the heading is off by up to this times the drift for each metre more, to either side [rad/m]. At 0.1 a
            drift of 2 % turns the robot's idea of its heading by up to 0.11 deg a metre, and after 20 m it is off by
            as much again to the side as along the path.
    """

    drift: Range = (0.0, 0.0)
    yaw_bias: float = 0.1

    def __post_init__(self) -> None:
        check_range("odometry.drift", self.drift, 0.0, 0.5)
        check_number("odometry.yaw_bias", self.yaw_bias, 0.0, 1.0)

    @property
    def is_exact(self) -> bool:
        """Whether robots know where they are."""
        return self.drift[1] == 0.0
