"""Detours: how a command has to be bent, gently and in time, so that the feet pass beside what is on its way.

No training bends commands any more. This goes with the weights of ``teacher`` and ``loco`` whose cards have detours.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
from jaxtyping import Bool
from scipy import ndimage

from vinl.config.errors import InputError
from vinl.robot.rotation import yaw_of
from vinl.world.grid import GROUND, GridFrame, HeightField

STANCE = np.array([[0.24, 0.157], [0.24, -0.157], [-0.24, 0.157], [-0.24, -0.157]])
"""(4, 2) where feet are taken to stand about the middle of the trunk [m]: below the hips, 0.313 m apart [maker's
meshes]."""

SIDEWAYS = (-0.3, -0.25, -0.2, -0.15, -0.1, -0.06, -0.03, 0.0, 0.03, 0.06, 0.1, 0.15, 0.2, 0.25, 0.3)
"""Sideways speeds that a detour may add [m/s]."""

TURNS = (-0.4, -0.3, -0.2, -0.14, -0.08, -0.04, 0.0, 0.04, 0.08, 0.14, 0.2, 0.3, 0.4)
"""Yaw rates that it may add [rad/s]."""

OFFERS = np.array(sorted(product(SIDEWAYS, TURNS), key=lambda offer: offer[0] ** 2 + offer[1] ** 2))
"""(k, 2) all detours, none at all first."""


@dataclass(frozen=True)
class DetourConfig:
    """What a detour may cost.

    The figures were chosen in MuJoCo C on courses of other seeds than those of the tables, see docs/teacher.md.

    Attributes:
        ahead: what lies farther from the middle of the trunk than this, along the way, is not seen yet [m].
        horizon: nor what is reached later than this [s].
        step: between the places on the way that are looked at [s].
        margin: a foot should pass a block or wall at this distance [m].
        price: of a foot that passes nearer, for each second that it does; a sideways speed costs its square for each
            second [m^2/s^2].
        turning: what a squared yaw rate costs, that of a squared sideways speed being 1 [m^2].
    """

    ahead: float = 2.4
    horizon: float = 3.0
    step: float = 0.15
    margin: float = 0.05
    price: float = 0.3
    turning: float = 2.0

    @property
    def reach(self) -> float:
        """How far from the middle of the trunk a foot may be looked for [m]."""
        return self.ahead + float(np.linalg.norm(STANCE, axis=1).max()) + max(SIDEWAYS) * self.horizon

    def __post_init__(self) -> None:
        for name in ("ahead", "horizon", "step", "price", "turning"):
            if not 0 < getattr(self, name) < np.inf:
                raise InputError(f"detour.{name} must be positive, got {getattr(self, name)}")
        if not 0 <= self.margin < 1:
            raise InputError(f"detour.margin must lie in [0, 1) m, got {self.margin}")
        if self.ahead <= STANCE[0, 0]:
            raise InputError(f"detour.ahead must be more than {STANCE[0, 0]} m, got {self.ahead}")
        if self.step > self.horizon:
            raise InputError(f"detour.step must be at most the horizon, {self.horizon} s, got {self.step}")


def keep_out(field: HeightField, margin: float) -> Bool[np.ndarray, "rows columns"]:
    """Which cells a foot should stay out of: blocks and walls, and what is nearer to them than the margin [m]."""
    r, free = field.frame.resolution, field.labels == GROUND
    if free.all():
        return ~free
    # the edge of what is labelled lies half a cell beyond the last labelled vertex, on average
    return np.asarray(ndimage.distance_transform_edt(free, sampling=r)) < margin + r / 2


def plan_detours(xp: Any, closed: Any, frame: GridFrame, qpos: Any, command: Any, config: DetourConfig) -> Any:
    """What to add to commands: of all sideways speeds and turns, held from now on, the cheapest.

    Each is followed as an arc on which the feet stand in place under the trunk. It costs its own square for each
    second, and a price for each second that a foot is where it should not be. If the command itself leads past
    everything, or stands still, nothing is added.

    Args:
        xp: ``numpy`` or ``jax.numpy``.
        closed: (rows * columns,) where feet should stay out, see ``keep_out``.
        frame: where the cells lie.
        qpos: (n, >= 7) position [m] and unit quaternion of the trunks.
        command: (n, 3) forward, left [m/s] and yaw rate [rad/s].
        config: prices and reach.

    Returns:
        (n, 2) sideways speed [m/s] and yaw rate [rad/s].
    """
    offers = xp.asarray(OFFERS, dtype=command.dtype)
    times = xp.asarray(np.arange(1, round(config.horizon / config.step) + 1) * config.step, dtype=command.dtype)
    forward, left = command[:, :1, None], (command[:, 1:2] + offers[:, 0])[..., None]
    turned = (command[:, 2:3] + offers[:, 1])[..., None] * times  # (n, offers, times)
    # how far an arc leads: the velocity, turned by all angles from 0 to the last one, on average
    chord = xp.sinc(turned / (2 * np.pi))
    along, across = chord * xp.cos(turned / 2), chord * xp.sin(turned / 2)
    ahead, aside = times * (along * forward - across * left), times * (across * forward + along * left)
    yaw = yaw_of(xp, qpos[:, 3:7])[:, None, None]
    c, s = xp.cos(yaw), xp.sin(yaw)
    x, y = qpos[:, :1, None] + c * ahead - s * aside, qpos[:, 1:2, None] + s * ahead + c * aside
    c, s = xp.cos(yaw + turned), xp.sin(yaw + turned)
    rows, columns = frame.shape
    hits = 0.0
    for before, beside in STANCE:
        j = xp.rint((x + c * before - s * beside - frame.x0) / frame.resolution)
        i = xp.rint((y + s * before + c * beside - frame.y0) / frame.resolution)
        row, column = xp.clip(i, 0, rows - 1).astype(xp.int32), xp.clip(j, 0, columns - 1).astype(xp.int32)
        hits = hits + xp.take(closed, row * columns + column, mode="clip")
    speed = xp.hypot(command[:, :1], command[:, 1:2])
    seen = speed[..., None] * times <= config.ahead - STANCE[0, 0]  # (n, 1, times)
    effort = offers[:, 0] ** 2 + config.turning * offers[:, 1] ** 2
    cost = xp.sum(seen * (config.price * hits + effort[:, None]), -1)
    return xp.where(speed > 0, offers[xp.argmin(cost, 1)], 0.0)


def bend_command(xp: Any, closed: Any, frame: GridFrame, qpos: Any, command: Any, config: DetourConfig) -> Any:
    """The commands (n, 3) with their detours; arguments as for ``plan_detours``."""
    detour = plan_detours(xp, closed, frame, qpos, command, config)
    return xp.concatenate([command[:, :1], command[:, 1:] + detour], 1)
