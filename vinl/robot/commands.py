"""Velocity commands of a locomotion policy: their ranges, and the one rule that training and evaluation draw by."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from jaxtyping import Float, Int

from vinl.config.errors import InputError
from vinl.config.limits import Range, check_fields
from vinl.robot.aliengo import CONTROL_DT


@dataclass(frozen=True)
class CommandConfig:
    """Velocity commands, drawn uniformly and held for a while.

    Attributes:
        forward, left: ranges of the linear velocity [m/s].
        yaw_rate: range of the turning rate [rad/s].
        hold: range of the time until the next command [s].
        min_speed: slower linear commands become zero [m/s] [legged_gym: 0.2].
        stand_share: fraction of commands that are zero.
        turn_share: fraction of commands that only turn on the spot.
    """

    forward: Range = (-1.0, 1.0)
    left: Range = (-1.0, 1.0)
    yaw_rate: Range = (-1.0, 1.0)
    hold: Range = (2.0, 10.0)
    min_speed: float = 0.2
    stand_share: float = 0.05
    turn_share: float = 0.1

    def __post_init__(self) -> None:
        ranges, fractions = ("forward", "left", "yaw_rate", "hold"), ("stand_share", "turn_share")
        check_fields(self, "commands.", rising=ranges, positive=("hold",), fractions=fractions)
        if self.stand_share + self.turn_share > 1:
            raise InputError("commands: stand_share and turn_share must be fractions that add up to at most 1")


UNIFORM = ("forward", "left", "yaw_rate", "kind", "hold")
"""What a command is made of, one number drawn uniformly from 0 to 1 for each: ``kind`` decides between walking, turning
and standing."""


def make_commands(
    xp: Any, config: CommandConfig, drawn: Float[Any, "*n 5"], hold_step: float = CONTROL_DT
) -> tuple[Float[Any, "*n 3"], Int[Any, "*n"]]:
    """Commands (..., 3), forward, left [m/s] and yaw rate [rad/s], and the control steps (...) until the next one, from
    numbers between 0 and 1 in the order of ``UNIFORM``; for numpy and jax.numpy (``xp``).

    The time until the next command is rounded to multiples of ``hold_step`` [s], itself one of ``CONTROL_DT``.
    """
    ranges = config.forward, config.left, config.yaw_rate
    forward, left, turn = (low + (high - low) * drawn[..., k] for k, (low, high) in enumerate(ranges))
    kind = drawn[..., UNIFORM.index("kind")]
    still = (xp.hypot(forward, left) < config.min_speed) | (kind < config.stand_share + config.turn_share)
    turn = xp.where(kind < config.stand_share, 0.0, turn)
    low, high = config.hold
    held = xp.maximum(xp.round((low + (high - low) * drawn[..., -1]) / hold_step), 1) * round(hold_step / CONTROL_DT)
    command = xp.stack([xp.where(still, 0.0, forward), xp.where(still, 0.0, left), turn], -1)
    return command, held.astype(xp.int32)
