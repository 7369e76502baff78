"""What the gait remembers of a robot, carried along with the trunk. For numpy, jax.numpy and torch (``xp``).

All places are in the *heading frame*: the origin in the middle of the trunk, x along its heading, z up. Nothing in it
is a place in the world, so that a robot with an estimated velocity can keep it as well as a simulator.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float

from vinl.gait.arrays import constant
from vinl.gait.clock import OFFSETS, follow_period, is_moving, swing_fraction, wanted_period
from vinl.gait.config import GaitConfig
from vinl.robot.aliengo import CONTROL_DT, LINK, foot_positions, knee_positions
from vinl.robot.rotation import wrap_angle, yaw_of

START_PHASE = 0.96
"""Phase in which a robot that stands waits for its next command: the legs that go first still bear weight; the others,
half a period behind, have ended a swing of at most 0.46 of it."""

FREEZE = 0.9
"""A foot that has swung for this fraction of its swing comes down where it was going."""

_RISE = 0.12
"""Time constant with which the trunk rises and sinks [s]."""

_OVER = 0.05
"""A knee under the hip passes this far above a block [m]."""

_CATCH = 0.1
"""Footholds move by the velocity's error times this [s]: a trunk that is too fast is caught by them."""

_MISSED = 0.12
"""A trunk need not catch up with more than this [m]: it may have been held up."""


class GaitState(NamedTuple):
    """One row a robot; legs in the order of ``LEGS``.

    Attributes:
        phases: (n, 4) of the legs, in [0, 1): a foot's swing begins at 0.
        period: (n,) of the clock at rate 1 [s].
        rate: (n, 4) how fast each leg's clock runs while its foot stands; swings keep to the period.
        lift: (n, 4, 3) where each foot last left the ground [m].
        target: (n, 4, 3) where it comes down next [m]; the middle of the foot.
        apex: (n, 4) height of its path's highest point [m].
        hip: (n,) how high above the ground the hips should be [m].
        missed: (n, 2) how far, forward and left, the trunk has fallen behind its commands [m], up to ``_MISSED``.
    """

    phases: Any
    period: Any
    rate: Any
    lift: Any
    target: Any
    apex: Any
    hip: Any
    missed: Any


class Plan(NamedTuple):
    """The foothold plan: what a planner reads from a map, or a network from images.

    Attributes:
        offset: (n, 4, 2) of the foothold from Raibert's, along and across the heading that the trunk will have [m].
        rise: (n, 4) height of the foothold over the place where the foot left the ground, or stands [m].
        apex: (n, 4) the same of the swing path's highest point [m].
        rate: (n, 4) how fast each leg's clock should run.
    """

    offset: Any
    rise: Any
    apex: Any
    rate: Any


def start_gait(xp: Any, config: GaitConfig, feet: Any) -> GaitState:
    """Robots that stand with their feet (n, 4, 3) where they are, in the heading frame [m]."""
    still = 0 * feet[..., 0]
    period = wanted_period(xp, config, still[:, :3])
    phases = (START_PHASE + constant(xp, OFFSETS, feet) + still) % 1.0
    apex, hip = feet[..., 2] + config.lift, period * 0 + config.hip_height
    return GaitState(phases, period, still + 1.0, feet, feet, apex, hip, still[:, :2])


def feet_in_heading_frame(xp: Any, qpos: Any) -> Any:
    """(n, 4, 3) middles of the feet in the heading frame [m], of robots at ``qpos`` (n, 19).

    Joint angles, roll and pitch are enough for it: place and heading are taken out again."""
    return _in_heading_frame(xp, qpos, foot_positions(xp, qpos))


def knees_in_heading_frame(xp: Any, qpos: Any) -> Any:
    """(n, 4, 3) the knees, as ``feet_in_heading_frame``."""
    return _in_heading_frame(xp, qpos, knee_positions(xp, qpos))


def _in_heading_frame(xp: Any, qpos: Any, points: Any) -> Any:
    here = points - qpos[:, None, :3]
    xy = turn(xp, -yaw_of(xp, qpos[:, 3:7])[:, None], here[..., :2])
    return xp.concatenate([xy, here[..., 2:]], -1)


def motion_between(xp: Any, before: Any, after: Any) -> Any:
    """(n, 4) how trunks moved, as ``tick`` wants it, from their poses (n, >= 7) before and after a control step."""
    yaw = yaw_of(xp, before[:, 3:7])
    moved = after[:, :3] - before[:, :3]
    turned = wrap_angle(yaw_of(xp, after[:, 3:7]) - yaw)
    return xp.concatenate([turn(xp, -yaw, moved[:, :2]), moved[:, 2:], turned[:, None]], -1)


def velocity_in_heading_frame(xp: Any, qpos: Any, qvel: Any) -> Any:
    """(n, 2) forward and left velocity of trunks [m/s]."""
    return turn(xp, -yaw_of(xp, qpos[:, 3:7]), qvel[:, :2])


def turn(xp: Any, angle: Any, xy: Any) -> Any:
    """Points (..., 2) turned by angles (...) [rad]."""
    c, s = xp.cos(angle), xp.sin(angle)
    return xp.stack([c * xy[..., 0] - s * xy[..., 1], s * xy[..., 0] + c * xy[..., 1]], -1)


def swings(xp: Any, config: GaitConfig, gait: GaitState) -> Any:
    """(n, 4) which feet are in the air by the clock."""
    return gait.phases < swing_fraction(xp, config, gait.period)[:, None]


def tick(xp: Any, config: GaitConfig, gait: GaitState, motion: Any, command: Any, feet: Any) -> GaitState:
    """One control step on: what is remembered follows the trunk's motion, the clock runs, feet lift off.

    Args:
        xp: ``numpy``, ``jax.numpy`` or ``torch``.
        config: of the gait.
        gait: before the step.
        motion: (n, 4) how the trunk moved in the step: forward, left, up [m] in the heading frame before it, and the
            turn of its heading [rad]; measured or estimated.
        command: (n, 3) forward, left [m/s], yaw rate [rad/s].
        feet: (n, 4, 3) middles of the feet in the heading frame after the step [m].
    """

    def carried(places: Any) -> Any:
        xy = turn(xp, -motion[:, None, 3], places[..., :2] - motion[:, None, :2])
        return xp.concatenate([xy, (places[..., 2] - motion[:, None, 2])[..., None]], -1)

    fraction = swing_fraction(xp, config, gait.period)[:, None]
    rests = ~is_moving(xp, command) & (gait.phases >= fraction).all(-1)
    period = follow_period(xp, config, gait.period, command)
    pace = xp.where(gait.phases < fraction, 1.0 + 0 * gait.rate, gait.rate)
    ran = (gait.phases + CONTROL_DT * pace / period[:, None]) % 1.0
    phases = xp.where(rests[:, None], xp.clip(gait.phases, None, START_PHASE), ran)
    leaves = (phases < gait.phases)[..., None]  # has passed 1
    lift = xp.where(leaves, feet, carried(gait.lift))
    apex = gait.apex - motion[:, None, 2]
    missed = turn(xp, -motion[:, 3], gait.missed)
    return GaitState(phases, period, gait.rate, lift, carried(gait.target), apex, gait.hip, missed)


def raibert(xp: Any, config: GaitConfig, gait: GaitState, velocity: Any, command: Any) -> tuple[Any, Any]:
    """Raibert's footholds: a foot comes down so that the hip passes over it in the middle of its stance.

    Args:
        xp, config, gait: as for ``tick``.
        velocity: (n, 2) of the trunk, forward and left [m/s].
        command: (n, 3).

    Returns:
        (n, 4, 2) the footholds in the heading frame [m], and (n, 4) the heading that the trunk will have then [rad].
    """
    left, moves, rate = time_to_touch_down(xp, config, gait), (velocity + command[:, :2]) / 2, command[:, None, 2]
    heading = rate * left
    stance = constant(xp, stance_places(config), left)
    about = xp.stack([-rate * stance[:, 1], rate * stance[:, 0]], -1)  # feet move with the turning, too
    half = stance_time(xp, config, gait)[:, None, None] / 2
    place = turn(xp, heading, stance + (command[:, None, :2] + about) * half)
    caught = _CATCH * (velocity - command[:, :2])[:, None]
    return turn(xp, heading / 2, moves[:, None] * left[..., None]) + place + caught, heading


def time_to_touch_down(xp: Any, config: GaitConfig, gait: GaitState) -> Any:
    """(n, 4) until each foot next comes down [s]."""
    phases, fraction = gait.phases, swing_fraction(xp, config, gait.period)[:, None]
    in_clock = xp.where(phases < fraction, fraction - phases, (1.0 - phases) / gait.rate + fraction)
    return in_clock * gait.period[:, None]


def stance_time(xp: Any, config: GaitConfig, gait: GaitState) -> Any:
    """(n,) how long a foot stands at rate 1 [s]."""
    return (1.0 - swing_fraction(xp, config, gait.period)) * gait.period


def stance_places(config: GaitConfig) -> Float[np.ndarray, "4 2"]:
    """(4, 2) where the feet stand, in the order of ``LEGS`` [m]."""
    x, y = config.stance
    return np.array([[x, y], [x, -y], [-x, y], [-x, -y]], np.float32)


def aim(
    xp: Any,
    config: GaitConfig,
    gait: GaitState,
    plan: Plan,
    velocity: Any,
    command: Any,
    feet: Any,
    freeze: float = FREEZE,
) -> GaitState:
    """Take a plan over: targets and apexes of all feet but those about to come down, and the clock's rate.

    Args:
        xp, config, gait, command, feet: as for ``tick``, whose result ``gait`` is.
        plan: for this control step.
        velocity: (n, 2) of the trunk, forward and left [m/s].
        freeze: fraction of a swing after which its foothold stays.
    """
    nominal, heading = raibert(xp, config, gait, velocity, command)
    xy = nominal + turn(xp, heading, plan.offset)
    phases, fraction = gait.phases, swing_fraction(xp, config, gait.period)[:, None]
    swinging = phases < fraction
    base = xp.where(swinging, gait.lift[..., 2], feet[..., 2])
    target = xp.concatenate([xy, (base + plan.rise)[..., None]], -1)
    frozen = swinging & (phases > freeze * fraction)
    target = xp.where(frozen[..., None], gait.target, target)
    apex = xp.where(frozen, gait.apex, base + plan.apex)
    over = xp.amax(xp.where(swinging, apex - gait.lift[..., 2], 0 * apex), -1) - config.lift + LINK + _OVER
    hip = xp.clip(over, config.hip_height, config.highest_hip)
    hip = gait.hip + (hip - gait.hip) * (CONTROL_DT / _RISE)
    missed = gait.missed + CONTROL_DT * (command[:, :2] - velocity)
    missed = xp.where(is_moving(xp, command)[:, None], xp.clip(missed, -_MISSED, _MISSED), 0 * missed)
    return gait._replace(target=target, apex=apex, rate=plan.rate, hip=hip, missed=missed)
