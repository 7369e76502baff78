"""The path of a swinging foot, and what a policy is told of the gait. For numpy, jax.numpy and torch (``xp``)."""

from __future__ import annotations

import math
from typing import Any

from vinl.gait.clock import swing_fraction
from vinl.gait.config import GaitConfig
from vinl.gait.state import GaitState
from vinl.robot.aliengo import CONTROL_DT

_RISES, _SINKS = 0.20, 0.12
"""At both ends of a swing the foot moves up or down alone, for these fractions of it: a foot is later than its path as
it lifts off, and the shank follows the foot as it comes down."""

_STEEP = 0.6
"""The height of the path is sin(pi s) to this power: at a tenth of the swing it is at half of its apex."""

GAIT_TERMS: tuple[tuple[str, int, float, str], ...] = (
    ("path_error", 12, 10.0, "m"),
    ("path_ahead", 12, 5.0, "m"),
    ("foothold", 8, 3.0, "m"),
    ("apex", 4, 5.0, "m"),
    ("leg_phase", 8, 1.0, "sine, cosine"),
    ("swing", 4, 1.0, "1"),
    ("swing_ahead", 4, 1.0, "1"),
    ("load_ahead", 4, 1.0, "1"),
    ("rate", 4, 3.0, "1"),
    ("hip", 1, 20.0, "m"),
    ("missed", 2, 10.0, "m"),
)
"""Name, size, scale and unit of what ``gait_rows`` gives, in its order: from each foot to the next point of its path
(x, y, z), to where the path is ``LOOK_AHEAD`` later, to its foothold (x, y) and to the height of its apex, all in the
heading frame; its phase; whether it swings, now and ``LOOK_AHEAD`` later, and whether it bears weight
``UNLOAD_AHEAD`` later if it stands, ``LOAD_AHEAD`` if it swings; how much faster its clock runs while it
stands; how far the hips should rise above their usual height; and how far the trunk is behind its commands."""

_DELAY = CONTROL_DT / 2
"""From an observation to the torque that answers it [s], without the latency: half a control step."""

LOOK_AHEAD = 0.085
"""Legs follow their targets so much later than the latency [s]: damping over stiffness, 0.05 s, the delay, and what it
takes to gain speed. A policy that sees only the next step is late."""

MEAN_LATENCY = 0.015
"""Of the training [s]."""

LATENCIES = 0.0, 0.04
"""Least and largest latency of an action that is told of [s]."""

UNLOAD_AHEAD, LOAD_AHEAD = _DELAY + 0.03, _DELAY - 0.01
"""Torques act sooner than motions [s]: after the delay. Feet lift off late, and come down early, by 20 ms if these are
the same."""

GAIT_SIZE = sum(size for _, size, _, _ in GAIT_TERMS)


def swing_path(xp: Any, config: GaitConfig, gait: GaitState, feet: Any, later: Any = 0.0) -> Any:
    """Where each foot should be.

    Args:
        xp: ``numpy``, ``jax.numpy`` or ``torch``.
        feet: (n, 4, 3) middles of the feet in the heading frame [m]; a foot that stands should be where it is.
        later: how far ahead on the path to look [s], or (n, 1); past its touch-down a foot is at its foothold, and one
            that has lifted off by then is on its way there from where it stands.

    Returns:
        (n, 4, 3) [m].
    """
    since, fraction = _since_lift_off(xp, config, gait, later)
    swinging = gait.phases < fraction
    s = xp.clip(since / fraction, 0.0, 1.0)
    lift = xp.where(swinging[..., None], gait.lift, feet)
    forth = xp.clip((s - _RISES) / (1 - _RISES - _SINKS), 0.0, 1.0)
    forth = (0.5 - 0.5 * xp.cos(math.pi * forth))[..., None]
    straight = lift + (gait.target - lift) * forth
    bell = (xp.sin(math.pi * s) + 1e-6) ** _STEEP  # s = 1 gives a sine just below 0 in float32
    height = straight[..., 2] + (gait.apex - straight[..., 2]) * bell
    path = xp.concatenate([straight[..., :2], height[..., None]], -1)
    return xp.where((since > 0)[..., None] | swinging[..., None], path, feet)


def _since_lift_off(xp: Any, config: GaitConfig, gait: GaitState, later: Any) -> tuple[Any, Any]:
    """(n, 4) periods that a foot will have swung then, less than 0 before its lift-off, and (n, 1) that it swings."""
    phases, fraction = gait.phases, swing_fraction(xp, config, gait.period)[:, None]
    swinging = phases < fraction
    stands = xp.where(swinging, 0 * phases, (1.0 - phases) / gait.rate)
    return xp.where(swinging, phases, 0 * phases) + later / gait.period[:, None] - stands, fraction


def _swings(xp: Any, config: GaitConfig, gait: GaitState, later: Any) -> Any:
    """(n, 4) which feet will be in the air then."""
    since, fraction = _since_lift_off(xp, config, gait, later)
    return (since > 0) & (since < fraction)


def gait_rows(xp: Any, config: GaitConfig, gait: GaitState, feet: Any, latency: Any) -> Any:
    """(n, GAIT_SIZE) what a policy observes of its gait, in SI units, in the order of ``GAIT_TERMS``.

    Args:
        xp, config, gait, feet: as for ``swing_path``.
        latency: (n,) from an observation to its action's effect [s].
    """
    late = latency[:, None]
    n = feet.shape[0]
    phases = gait.phases
    swinging = phases < swing_fraction(xp, config, gait.period)[:, None]
    error = swing_path(xp, config, gait, feet, CONTROL_DT) - feet
    apex = xp.where(swinging, gait.apex - feet[..., 2], 0 * feet[..., 2])
    angle, none = 2 * math.pi * phases, 0 * apex
    load_ahead = xp.where(swinging, none + LOAD_AHEAD, none + UNLOAD_AHEAD)
    swings_then, unloaded = (_swings(xp, config, gait, later + late) for later in (LOOK_AHEAD, load_ahead))
    parts = [
        xp.clip(error, -0.5, 0.5).reshape(n, 12),
        xp.clip(swing_path(xp, config, gait, feet, LOOK_AHEAD + late) - feet, -0.5, 0.5).reshape(n, 12),
        xp.clip((gait.target - feet)[..., :2], -1.0, 1.0).reshape(n, 8),
        xp.clip(apex, -0.5, 0.5),
        xp.stack([xp.sin(angle), xp.cos(angle)], -1).reshape(n, 8),
        xp.where(swinging, none + 1.0, none),
        xp.where(swings_then, none + 1.0, none),
        xp.where(unloaded, none, none + 1.0),
        gait.rate - 1.0,
        (gait.hip - config.hip_height)[:, None],
        gait.missed,
    ]
    return xp.concatenate(parts, -1)
