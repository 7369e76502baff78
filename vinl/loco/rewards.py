"""The reward terms: each a number for every robot, before its weight."""

from __future__ import annotations

from typing import NamedTuple

import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from vinl.loco.simulation import Contacts
from vinl.loco.walking import Steps
from vinl.robot.aliengo import CONTROL_DT, JOINT_SPEED_LIMIT

TRACKING = ((0.3, 0.02), (0.3, 0.003), (0.4, 0.0006))
"""Weights and widths [m^2] of the foot tracking: they tell 20 cm from 10, 5 from 3 and 2 from 1. Errors
of swinging feet are 14 cm in the beginning of a training and some 3 cm at its end."""

FAST = 0.9
"""Joint speeds beyond this fraction of the data sheet's cost."""

MAX_SLIP = 1.0
"""A foot that slips faster than this costs no more [m/s]."""

HEIGHT_WIDTH = 0.02
"""A hip so far from the height that footholds are chosen for has two thirds of its price [m]: 2 cm lower, and no shank
clears a bar of 15 cm."""

MARGIN = 0.03
"""A leg nearer than this to a block costs [m]: contacts alone tell too late, and too seldom."""


class Motion(NamedTuple):
    """What the terms are computed from; velocities in the trunk's frame.

    Attributes:
        linear, angular: (n, 3) velocity of the trunk [m/s, rad/s].
        gravity: (n, 3) unit vector down.
        joint_speed, last_joint_speed: (n, 12) now and a control step ago [rad/s].
        torque: (n, 12) [N m].
        action, last_action: (n, 12).
        command: (n, 3) forward, left [m/s], yaw rate [rad/s].
        contacts: latched over the control step.
        landed: (n, 4) feet that touch down in this step.
        fallen: (n,).
    """

    linear: Float[Array, "n 3"]
    angular: Float[Array, "n 3"]
    gravity: Float[Array, "n 3"]
    joint_speed: Float[Array, "n 12"]
    last_joint_speed: Float[Array, "n 12"]
    torque: Float[Array, "n 12"]
    action: Float[Array, "n 12"]
    last_action: Float[Array, "n 12"]
    command: Float[Array, "n 3"]
    contacts: Contacts
    landed: Bool[Array, "n 4"]
    steps: Steps
    fallen: Bool[Array, " n"]


def distance2(path_error: Float[Array, "n 4 3"]) -> Float[Array, "n 4"]:
    """Squared distance of feet from their paths [m^2]; a foot may be higher than its path."""
    return jnp.sum(path_error[..., :2] ** 2, -1) + jnp.maximum(path_error[..., 2], 0.0) ** 2


def reward_terms(m: Motion, sigma: Array | float) -> dict[str, Float[Array, " n"]]:
    """Every term by its name in ``RewardConfig`` [ViNL code, section 2 of its rewards].

    Returns:
        Term name to (n,) values; ``fall`` is divided by the control step, so that its weight is per fall.
    """
    error2 = jnp.sum((m.command[:, :2] - m.linear[:, :2]) ** 2, 1)
    foot_hit, shank_hit = m.contacts.foot_block | m.contacts.foot_wall, m.contacts.shank_block | m.contacts.shank_wall
    steps = m.steps
    lack = jnp.maximum(steps.path_error[..., 2], 0.0)
    tracking = sum(weight * jnp.exp(-distance2(steps.path_error) / width) for weight, width in TRACKING)
    fast = jnp.maximum(jnp.abs(m.joint_speed) - jnp.asarray(FAST * JOINT_SPEED_LIMIT, jnp.float32), 0.0)
    slip = jnp.where(steps.swing, 0.0, jnp.minimum(steps.speed, MAX_SLIP))
    return {
        "linear_velocity": jnp.exp(-error2 / sigma),
        "yaw_rate": jnp.exp(-((m.command[:, 2] - m.angular[:, 2]) ** 2) / sigma),
        "vertical_velocity": m.linear[:, 2] ** 2,
        "roll_pitch_rate": jnp.sum(m.angular[:, :2] ** 2, 1),
        "orientation": jnp.sum(m.gravity[:, :2] ** 2, 1),
        "hip_height": 1.0 - jnp.exp(-((steps.height_error / HEIGHT_WIDTH) ** 2)).mean(1),
        "torque": jnp.sum(m.torque**2, 1),
        "joint_acceleration": jnp.sum(((m.joint_speed - m.last_joint_speed) / CONTROL_DT) ** 2, 1),
        "joint_speed": jnp.sum(fast**2, 1),
        "action_rate": jnp.sum((m.action - m.last_action) ** 2, 1),
        "foot_tracking": jnp.mean(jnp.where(steps.swing, tracking, m.contacts.foot), 1),
        "clearance": jnp.sum(jnp.where(steps.swing, lack, 0.0), 1),
        "swing_contact": jnp.sum(steps.middle & m.contacts.foot, 1).astype(jnp.float32),
        "slip": jnp.sum(slip**2, 1),
        "collision": m.contacts.shank.sum(1) + m.contacts.trunk.astype(jnp.float32),
        "obstacle_contact": foot_hit.sum(1).astype(jnp.float32),
        "leg_contact": shank_hit.sum(1).astype(jnp.float32),
        "near_block": jnp.sum(jnp.clip(1.0 - steps.gap / MARGIN, 0.0, 1.0), 1),
        "leg_crossing": m.contacts.crossing.astype(jnp.float32),
        "fall": m.fallen / CONTROL_DT,
    }
