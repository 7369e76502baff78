"""The gait of the training's robots: clock, footholds from the exact map, and how well feet keep to them."""

from __future__ import annotations

from typing import NamedTuple

import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from vinl.gait.clock import swing_fraction
from vinl.gait.config import GaitConfig
from vinl.gait.footholds import EDGE, plan_footholds
from vinl.gait.ground_view import FieldView
from vinl.gait.local_map import POINTS, floor_under
from vinl.gait.path import swing_path
from vinl.gait.state import (
    GaitState,
    aim,
    feet_in_heading_frame,
    knees_in_heading_frame,
    motion_between,
    start_gait,
    swings,
    tick,
    velocity_in_heading_frame,
)
from vinl.loco.simulation import SHANK_REACH, Body, DeviceGround
from vinl.robot.aliengo import CONTROL_DT, FOOT_RADIUS, HIPS
from vinl.robot.rotation import rotate_inverse
from vinl.world.grid import GridFrame

MIDDLE = (0.2, 0.85)
"""Between these fractions of its swing a foot should touch nothing."""

_FREEZE = 0.5
"""Fraction of a swing after which a foothold stays in training; ``vinl.gait.state.FREEZE`` holds when a policy walks.
Feet that learn on footholds which move until late come down short of them (docs/research, 26 November)."""

_ALONG_SHANK = (0.12, 0.25, 0.4, 0.6, 0.8)
"""Places along a shank that are held against blocks, from the foot (0) to the knee (1)."""


class Steps(NamedTuple):
    """How the feet kept to the gait in a control step.

    Attributes:
        path_error: (n, 4, 3) from each foot to its path [m]; 0 of feet that stand.
        swing, middle: (n, 4) which feet swing, and are in the middle of it.
        gap: (n, 4) from each leg below the knee to the nearest block or wall [m].
        blocked: (n, 4) swinging feet whose foothold is on a block or nearer to one than ``EDGE``.
        speed: (n, 4) of the feet along the ground [m/s].
        height_error: (n, 4) of each hip over its foot, against the gait's [m]; 0 of feet that swing.
    """

    path_error: Float[Array, "n 4 3"]
    swing: Bool[Array, "n 4"]
    middle: Bool[Array, "n 4"]
    gap: Float[Array, "n 4"]
    blocked: Bool[Array, "n 4"]
    speed: Float[Array, "n 4"]
    height_error: Float[Array, "n 4"]


def begin_gait(config: GaitConfig, body: Body) -> GaitState:
    """Of robots that stand where they are."""
    return start_gait(jnp, config, feet_in_heading_frame(jnp, body.qpos))


def go_on(
    config: GaitConfig,
    ground: DeviceGround,
    frame: GridFrame,
    gait: GaitState,
    before: Body,
    body: Body,
    command: Float[Array, "n 3"],
    planned: bool = True,
) -> tuple[GaitState, Steps]:
    """One control step of the gait, planned on the exact map and with the exact velocity.

    Args:
        planned: False: the clock runs on, but whoever gave ``gait`` plans its footholds.
    """
    feet, velocity = feet_in_heading_frame(jnp, body.qpos), velocity_in_heading_frame(jnp, body.qpos, body.qvel)
    moved = motion_between(jnp, before.qpos, body.qpos)
    gait = tick(jnp, config, gait, moved, command, feet)
    view = FieldView(jnp, ground.map, frame, body.qpos)
    if planned:
        plan = plan_footholds(jnp, config, view if config.map else None, gait, velocity, command, feet)
        gait = aim(jnp, config, gait, plan, velocity, command, feet, freeze=_FREEZE)

    swing, fraction = swings(jnp, config, gait), swing_fraction(jnp, config, gait.period)[:, None]
    progress = gait.phases / fraction
    down = jnp.broadcast_to(jnp.array([0.0, 0.0, -1.0]), (len(feet), 3))
    hips = -rotate_inverse(jnp, body.qpos[:, 3:7], down) @ jnp.asarray(HIPS.T, jnp.float32)  # above the trunk's middle
    last = feet_in_heading_frame(jnp, before.qpos)
    turned = moved[:, None, 3:]
    carried = last[..., :2] - moved[:, None, :2]
    c, s = jnp.cos(turned[..., 0]), jnp.sin(turned[..., 0])
    x, y = c * carried[..., 0] + s * carried[..., 1], c * carried[..., 1] - s * carried[..., 0]
    steps = Steps(
        path_error=swing_path(jnp, config, gait, feet) - feet,
        swing=swing,
        middle=swing & (progress > MIDDLE[0]) & (progress < MIDDLE[1]),
        gap=_leg_gap(view, body, feet),
        blocked=swing & (view.clearance(gait.target) - FOOT_RADIUS < EDGE),
        speed=jnp.hypot(feet[..., 0] - x, feet[..., 1] - y) / CONTROL_DT,
        height_error=jnp.where(swing, 0.0, hips - feet[..., 2] + FOOT_RADIUS - gait.hip[:, None]),
    )
    return gait, steps


def _leg_gap(view: FieldView, body: Body, feet: Float[Array, "n 4 3"]) -> Float[Array, "n 4"]:
    """How far foot and shank of each leg are from the nearest block or wall [m]."""
    shank = knees_in_heading_frame(jnp, body.qpos)[:, :, None] - feet[:, :, None]
    shank = feet[:, :, None] + shank * jnp.asarray(_ALONG_SHANK, jnp.float32)[:, None]
    foot, axis = view.clearance(feet) - FOOT_RADIUS, view.clearance(shank).min(-1) - SHANK_REACH
    return jnp.minimum(foot, axis)


def local_heights(ground: DeviceGround, frame: GridFrame, body: Body) -> Float[Array, "n 741"]:
    """The ground about every robot at ``local_map.POINTS``, above the floor under its feet [m]."""
    feet = feet_in_heading_frame(jnp, body.qpos)
    points = jnp.broadcast_to(jnp.asarray(POINTS, jnp.float32), (len(feet), *POINTS.shape))
    return FieldView(jnp, ground.map, frame, body.qpos).height(points) - floor_under(jnp, feet)[:, None]
