"""What the gait is like: a YAML group of every locomotion training, kept in the policy's card."""

from __future__ import annotations

from dataclasses import dataclass

from vinl.config.errors import InputError
from vinl.robot.aliengo import FOOT_RADIUS


@dataclass(frozen=True)
class GaitConfig:
    """A trot whose period follows the commanded speed, and how footholds are chosen.

    Attributes:
        stride: way of the trunk in one period, where ``period`` allows it [m]. At the distance between front and rear
            hips (0.48 m) the diagonal legs meet a bar across the path with the same phase.
        period: least and largest period [s]. Two legs do not carry a trunk for long: with
            1.4 s feet touched more at 0.3 m/s.
        swing_time: of a foot [s], where ``swing_fraction`` allows it.
        swing_fraction: largest fraction of the period that a foot swings.
        stance: where the feet stand under the standing trunk, from its middle, forward and aside [m].
        hip_height: of the hips above the ground that the planner reckons with [m]: the lower, the farther the feet
            reach and the farther back the shanks lean.
        highest_hip: how far the hips rise while a leg swings over something high [m]: where the thigh hangs straight
            down, the knee would pass through it.
        lift: height of the swing path's apex over what lies below it [m].
        map: choose footholds on the map; False: Raibert's as they are, for policies that know no map.
        modulate: largest change of a leg's rate while its foot stands, as a fraction: it meets a block better early or
            late. Swings keep to the period: a leg that should swing slower than it is used to comes down too early.
    """

    stride: float = 0.48
    period: tuple[float, float] = (0.6, 0.9)
    swing_time: float = 0.45
    swing_fraction: float = 0.45
    stance: tuple[float, float] = (0.24, 0.15)
    hip_height: float = 0.43
    highest_hip: float = 0.47
    lift: float = 0.08
    map: bool = True
    modulate: float = 0.4

    def __post_init__(self) -> None:
        low, high = self.period
        if not 0 < low <= high:
            raise InputError(f"gait.period: need 0 < least <= largest, got {list(self.period)} s")
        for name in ("stride", "swing_time", "lift"):
            if not 0 < getattr(self, name) < 10:
                raise InputError(f"gait.{name} must be positive, got {getattr(self, name)}")
        if not 0 < self.swing_fraction <= 0.5:
            raise InputError(f"gait.swing_fraction must lie in (0, 0.5]: two feet stand, got {self.swing_fraction}")
        if not 2 * FOOT_RADIUS < self.hip_height < 0.5:
            raise InputError(f"gait.hip_height must lie between {2 * FOOT_RADIUS} and 0.5 m, got {self.hip_height}")
        if not self.hip_height <= self.highest_hip < 0.5:
            raise InputError(f"gait.highest_hip must lie between hip_height and 0.5 m, got {self.highest_hip}")
        if not 0 <= self.modulate < 1:
            raise InputError(f"gait.modulate must lie in [0, 1), got {self.modulate}")
