"""The reward terms: each a number for every robot, before its weight."""

from __future__ import annotations

from typing import NamedTuple

import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from vinl.loco.simulation import Contacts
from vinl.robot.aliengo import CONTROL_DT, DEFAULT_POSE


class Motion(NamedTuple):
    """What the terms are computed from; velocities in the trunk's frame.

    Attributes:
        linear, angular: (n, 3) velocity of the trunk [m/s, rad/s].
        gravity: (n, 3) unit vector down.
        joints: (n, 12) angles [rad].
        joint_speed, last_joint_speed: (n, 12) now and a control step ago [rad/s].
        torque: (n, 12) [N m].
        action, last_action: (n, 12).
        command: (n, 3) forward, left [m/s], yaw rate [rad/s].
        contacts: latched over the control step.
        air_time: (n, 4) seconds since each foot left the ground, this step included.
        landed: (n, 4) feet that touch down in this step.
        fallen: (n,).
    """

    linear: Float[Array, "n 3"]
    angular: Float[Array, "n 3"]
    gravity: Float[Array, "n 3"]
    joints: Float[Array, "n 12"]
    joint_speed: Float[Array, "n 12"]
    last_joint_speed: Float[Array, "n 12"]
    torque: Float[Array, "n 12"]
    action: Float[Array, "n 12"]
    last_action: Float[Array, "n 12"]
    command: Float[Array, "n 3"]
    contacts: Contacts
    air_time: Float[Array, "n 4"]
    landed: Bool[Array, "n 4"]
    fallen: Bool[Array, " n"]


def reward_terms(m: Motion, sigma: Array | float) -> dict[str, Float[Array, " n"]]:
    """Every term by its name in ``RewardConfig`` [ViNL code, section 2 of its rewards].

    Args:
        m: the motion of the last control step.
        sigma: width of the tracking terms.

    Returns:
        Term name to (n,) values; ``fall`` is divided by the control step, so that its weight is per fall.
    """
    speed = jnp.linalg.norm(m.command[:, :2], axis=1)
    error2 = jnp.sum((m.command[:, :2] - m.linear[:, :2]) ** 2, 1)
    foot_hit, shank_hit = m.contacts.foot_block | m.contacts.foot_wall, m.contacts.shank_block | m.contacts.shank_wall
    told_to_stand = (speed < 0.1) & (jnp.abs(m.command[:, 2]) < 0.1)
    return {
        "linear_velocity": jnp.exp(-error2 / sigma),
        "yaw_rate": jnp.exp(-((m.command[:, 2] - m.angular[:, 2]) ** 2) / sigma),
        "vertical_velocity": m.linear[:, 2] ** 2,
        "roll_pitch_rate": jnp.sum(m.angular[:, :2] ** 2, 1),
        "torque": jnp.sum(m.torque**2, 1),
        "joint_acceleration": jnp.sum(((m.joint_speed - m.last_joint_speed) / CONTROL_DT) ** 2, 1),
        "action_rate": jnp.sum((m.action - m.last_action) ** 2, 1),
        "collision": m.contacts.shank.sum(1) + m.contacts.trunk.astype(jnp.float32),
        "air_time": jnp.sum((m.air_time - 0.5) * m.landed, 1) * (speed > 0.1),
        "obstacle_contact": foot_hit.sum(1).astype(jnp.float32),
        "leg_contact": shank_hit.sum(1).astype(jnp.float32),
        "orientation": jnp.sum(m.gravity[:, :2] ** 2, 1),
        "stand_still": jnp.sum(jnp.abs(m.joints - jnp.asarray(DEFAULT_POSE, jnp.float32)), 1) * told_to_stand,
        "fall": m.fallen / CONTROL_DT,
    }
