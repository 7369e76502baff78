"""Footholds chosen on a map: the cheapest place near Raibert's that neither foot nor shank would touch a block from.

For numpy, jax.numpy and torch alike (``xp``).
"""

from __future__ import annotations

from typing import Any

import numpy as np

from vinl.gait.arrays import constant, take_along, to_index
from vinl.gait.clock import unison
from vinl.gait.config import GaitConfig
from vinl.gait.ground_view import GroundView
from vinl.gait.leg import SHANK_FRACTIONS, farthest, knee_from_foot
from vinl.gait.state import (
    GaitState,
    Plan,
    raibert,
    stance_places,
    stance_time,
    swings,
    turn,
)
from vinl.robot.aliengo import FOOT_RADIUS, HIPS, THIGH_ASIDE

ALONG = np.arange(-6, 7) * 0.055
"""(13,) offsets of candidates from Raibert's foothold, along the heading [m]."""

ACROSS = np.arange(-3, 4) * 0.06
"""(7,) the same across it, to the left [m]."""

CANDIDATES = np.stack(np.meshgrid(ALONG, ACROSS, indexing="ij"), -1).reshape(-1, 2).astype(np.float32)
"""(91, 2) all of them."""

_WIDTH = (0.15, 0.10)
"""Offsets along and across that cost 1 [m]."""

_BESIDE, _OTHER = (0.18, 0.04), (1, 0, 3, 2)
"""A foothold this far aside from that of the leg on the other side is free; so much nearer costs 1 [m]."""

EDGE, _SHANK = 0.03, 0.04
"""Footholds cost whose foot is with its surface, whose shank with its axis nearer to a block than this [m]."""

_THIGHS = (HIPS[:, 1] + THIGH_ASIDE).astype(np.float32)
"""(4,) how far to the left of the trunk's middle the thigh joints lie [m]: shanks lean towards them."""

_NEAR, _ROOM = 200.0, 0.005
"""What each metre nearer costs, and how far that goes [m]: over what is high, it is this or reach."""

_BLOCKED, _DEEP = (30.0, 12.0), (300.0, 200.0)
"""What a foothold costs whose foot, whose shank is nearer still, and each metre that it is."""

_OUT_OF_REACH = 300.0
"""What each metre beyond the leg's reach costs."""

_CHANGE = 60.0
"""What a swinging foot's change of its foothold costs, each m^2 [1/m^2], up to 0.2 m."""

PATH = np.linspace(0.0, 1.0, 9, dtype=np.float32)
"""(9,) places on the way from lift-off to touch-down at which the map is read for the apex."""


def plan_footholds(
    xp: Any, config: GaitConfig, view: GroundView | None, gait: GaitState, velocity: Any, command: Any, feet: Any
) -> Plan:
    """Choose a foothold, an apex and the clock's rate for every robot.

    Args:
        xp: ``numpy``, ``jax.numpy`` or ``torch``.
        config: of the gait.
        view: the ground; None: level, and nothing on it.
        gait: after ``state.tick``.
        velocity: (n, 2) of the trunk in the heading frame [m/s].
        command: (n, 3) forward, left [m/s], yaw rate [rad/s].
        feet: (n, 4, 3) middles of the feet in the heading frame [m].
    """
    level = 0 * feet[..., 2]
    if view is None or not config.map:
        return Plan(xp.stack([level, level], -1), level, level + config.lift, level + 1.0)
    swinging = swings(xp, config, gait)
    nominal, heading = raibert(xp, config, gait, velocity, command)
    candidates = constant(xp, CANDIDATES, level)
    points = nominal[:, :, None] + turn(xp, heading[..., None], candidates[None, None])
    cost = obstruction(xp, config, view, gait, command, points, heading, candidates)
    leans = constant(xp, np.stack([LEANS, 0 * LEANS], -1), level)[:, None]
    blocked = obstruction(xp, config, view, gait, command, _tracks(xp, nominal, heading, command), heading, leans)
    side = constant(xp, np.sign(stance_places(config)[:, 1]), level)[:, None]
    places = xp.where(swinging[..., None], gait.target, feet)[..., None, :2]
    other = xp.stack([places[:, leg] for leg in _OTHER], 1)  # an index would be copied to a GPU
    aside = turn(xp, -heading[..., None], points - other)[..., 1] * side
    inward = xp.clip(_BESIDE[0] - aside, 0.0, None) / _BESIDE[1]
    cost = cost + ((candidates[:, 0] / _WIDTH[0]) ** 2 + (candidates[:, 1] / _WIDTH[1]) ** 2 + inward**2)
    moved = ((points - gait.target[:, :, None, :2]) ** 2).sum(-1)
    cost = cost + xp.where(swinging[..., None], _CHANGE * xp.clip(moved, 0.0, 0.04), 0.0)
    best = xp.argmin(cost, -1)[..., None]
    chosen = take_along(xp, points, best[..., None], 2)[:, :, 0]
    offset = take_along(xp, xp.broadcast_to(candidates, points.shape), best[..., None], 2)[:, :, 0]

    start = xp.where(swinging[..., None], gait.lift, feet)
    base = start[..., 2]
    rise = view.height(chosen) + FOOT_RADIUS - base
    way = start[..., None, :2] + (chosen - start[..., :2])[..., None, :] * constant(xp, PATH, level)[:, None]
    over = xp.amax(view.crest(way), -1) + FOOT_RADIUS - base
    apex = xp.maximum(over, xp.clip(rise, 0.0, None)) + config.lift
    return Plan(offset, rise, apex, _choose_rates(xp, config, gait, command, feet, blocked))


def obstruction(
    xp: Any,
    config: GaitConfig,
    view: GroundView,
    gait: GaitState,
    command: Any,
    points: Any,
    heading: Any,
    offsets: Any,
) -> Any:
    """What blocks and the leg's reach cost at footholds.

    The leg is held against the blocks as it is at touch-down and at lift-off: foot, and points along the shank.

    Args:
        xp, config, view, gait, command: as for ``plan_footholds``.
        points: (n, 4, k, 2) footholds in the heading frame [m]; or (n, 4, 1, k, 2), each with every one of ``along``.
        heading: (n, 4) of the trunk then [rad].
        offsets: (k, 2) how far ahead of Raibert's footholds, and to the left of them, they are [m]; or (j, 1, 2).

    Returns:
        (n, 4, k), or (n, 4, j, k), 0 where nothing is in the way.
    """
    along, across = offsets[..., 0], offsets[..., 1]
    ones = (1,) * along.ndim

    def by_leg(values: Any) -> Any:
        return values.reshape(-1, 4, *ones)

    ground = view.height(points) + FOOT_RADIUS
    stands, places = stance_time(xp, config, gait)[:, None] / 2, constant(xp, stance_places(config), along)
    sweep = command[:, :1] * stands
    to_hip = constant(xp, HIPS[:, 0].astype(np.float32), along)
    touch_down = by_leg(places[:, 0] - to_hip + sweep) + along
    ahead = xp.stack([touch_down, touch_down - 2 * by_leg(sweep + 0 * to_hip)], -1)
    turned = by_leg(command[:, 2:] * stands * places[:, 0])
    aside = by_leg(places[:, 1] - constant(xp, _THIGHS, along)) + across
    aside = xp.stack([aside + turned, aside - turned], -1)
    hip = (gait.hip - FOOT_RADIUS).reshape(-1, 1, *ones, 1)
    long = xp.sqrt(hip**2 + aside**2)  # the leg lies in a plane that leans by as much
    back, up = knee_from_foot(xp, ahead, long)
    in_, up = -aside * up / long, up * hip / long
    parts = constant(xp, np.array(SHANK_FRACTIONS, np.float32), along)
    back, in_, up = ((x[..., None] * parts).reshape(*x.shape[:-1], 2 * len(SHANK_FRACTIONS)) for x in (back, in_, up))
    c, s = (by_leg(f(heading))[..., None] for f in (xp.cos, xp.sin))
    lying = xp.stack([c * back - s * in_, s * back + c * in_], -1)
    leg = xp.concatenate([points[..., None, :] + lying, (ground[..., None] + up)[..., None]], -1)
    foot = xp.concatenate([points, ground[..., None]], -1)
    short = xp.amax(_SHANK - view.clearance(leg), -1)
    too_far = xp.clip(xp.abs(ahead) - farthest(xp, long), 0.0, None).sum(-1)
    touches = _price(xp, FOOT_RADIUS + EDGE - view.clearance(foot), 0) + _price(xp, short, 1)
    return touches + _OUT_OF_REACH * too_far


def _price(xp: Any, lack: Any, kind: int) -> Any:
    return xp.where(lack > _ROOM, _BLOCKED[kind] + _DEEP[kind] * lack, _NEAR * xp.clip(lack, 0.0, None))


# ---- the clocks' rates -----------------------------------------------------------------------------------------------

RATES = 7
"""How many rates are looked at."""

TRACK = np.arange(-6, 25) * 0.055
"""(31,) places along each foot's track that are looked at, from its next foothold at the present rate [m]."""


_STEPS = 3
"""How many footholds of each foot ahead its rate is chosen by."""

_LEAST_SPEED = 0.15
"""Below this the rates stay 1 [m/s]: footholds hardly move with them."""

_RELAX = 0.2
"""Fraction of the way to the chosen rate that a leg's rate goes in a control step."""


_RATE_COST = 1.0
"""What the largest change of a rate costs."""

_APART = 0.1
"""Phase by which a leg may leave the trot at a cost of 1."""

LEANS = ALONG[3:-3].astype(np.float32)
"""(7,) offsets from Raibert's footholds for which a track is looked at [m]: the farther ahead of the hip a foot comes
down, the farther back its shank leans; from beyond them a leg reaches hardly anything."""


def _tracks(xp: Any, nominal: Any, heading: Any, command: Any) -> Any:
    """(n, 4, 1, 31, 2) places along the track of each foot [m]."""
    track = constant(xp, TRACK.astype(np.float32), nominal)
    course = command[:, :2] / xp.clip(_speed(xp, command), _LEAST_SPEED, None)[:, None]
    direction = turn(xp, heading, course[:, None] + 0 * nominal)
    return (nominal[:, :, None] + direction[:, :, None] * track[:, None])[:, :, None]


def _speed(xp: Any, command: Any) -> Any:
    return xp.sqrt(command[:, 0] ** 2 + command[:, 1] ** 2)


def _choose_rates(xp: Any, config: GaitConfig, gait: GaitState, command: Any, feet: Any, blocked: Any) -> Any:
    """(n, 4) the rates at which the next footholds of every foot ask for the smallest offsets.

    ``blocked`` (n, 4, 7, 31) is what is in the way along the tracks; what a foothold would cost whose Raibert place is
    at any of their places follows from it, and with that the cost of every rate, held for one stance. First a rate for
    all legs together: they meet a bar in phase. Then one for each, which is drawn back to the trot.
    """
    if config.modulate == 0:
        return 0 * gait.rate + 1.0
    speed, cost = _speed(xp, command), _cost_along_tracks(xp, blocked)
    rates = constant(xp, np.linspace(1 - config.modulate, 1 + config.modulate, RATES, dtype=np.float32), speed)
    period = gait.period[:, None, None]
    stands = xp.where(swings(xp, config, gait), 0 * gait.phases, 1.0 - gait.phases)[..., None] * period
    whole = stance_time(xp, config, gait)[:, None, None] * (1.0 / rates - 1.0)  # (n, 1, rates) gained by a whole stance
    now = stands / gait.rate[..., None]
    total = 0 * now + _RATE_COST * ((rates - 1) / config.modulate) ** 2
    for k in range(_STEPS):
        later = stands / rates - now if k == 0 else whole + stands - now + k * period
        index = (later * speed[:, None, None] - float(TRACK[0])) / float(TRACK[1] - TRACK[0])
        index = xp.clip(index, 0.0, len(TRACK) - 1.001)
        below = xp.floor(index)
        part, low = index - below, to_index(xp, below)
        read = take_along(xp, cost, low, 2) * (1 - part) + take_along(xp, cost, low + 1, 2) * part
        total = total + xp.clip(read, 0.0, 20.0)
    hips = constant(xp, HIPS[:, 0].astype(np.float32), feet)
    room = feet[..., 0] - hips + farthest(xp, gait.hip - FOOT_RADIUS)[:, None]
    lack = xp.clip(command[:, 0, None, None] * stands / rates - room[..., None], 0.0, None)
    total = total + xp.where(stands > 0, _OUT_OF_REACH * lack, 0.0)
    together = xp.argmin(total.sum(1), -1)[:, None]
    common = take_along(xp, whole[:, 0], together, 1)[..., None]
    apart = unison(xp, gait.phases)[..., None] - (whole - common) / period
    best = xp.take(rates, xp.argmin(total + (apart / _APART) ** 2, -1))
    wanted = xp.where((speed > _LEAST_SPEED)[:, None], best, 1.0 + 0 * best)
    return gait.rate + _RELAX * (wanted - gait.rate)


def _cost_along_tracks(xp: Any, blocked: Any) -> Any:
    """(n, 4, 31) what a foothold costs whose Raibert place is there: the best of those it can be moved to."""
    spread, long = len(ALONG) // 2, len(TRACK)
    by_lean = [blocked[..., k, :] for k in range(len(LEANS))]
    padded = [xp.concatenate([b[..., :1]] * spread + [b] + [b[..., -1:]] * spread, -1) for b in by_lean]
    cost = None
    for k, shift in enumerate(ALONG):
        nearest = int(np.abs(LEANS - shift).argmin())
        window = padded[nearest][..., k : k + long] + float((shift / _WIDTH[0]) ** 2)
        cost = window if cost is None else xp.minimum(cost, window)
    return cost
