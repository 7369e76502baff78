"""Robots whose numbers went wrong: the state before that step stays on the device until somebody asks for it."""

from __future__ import annotations

from typing import NamedTuple

import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from vinl.loco.simulation import PAST
from vinl.loco.state import EnvState

KEPT = 16
"""How many states are kept until they are taken; later ones are only counted."""

REASONS = ("physics", "speed", "action", "reward", "observation")
"""What went wrong: position, velocity or torque is not finite; a joint is faster than any motor; the policy's action,
the reward or the observation is not finite. The first that applies counts."""

TRAITS = ("friction", "added_mass", "kp", "kd", "joint_friction")
"""What is kept of what the robot is like, see ``randomisation.Traits``."""


class Lost(NamedTuple):
    """States before the step that went wrong, in the order in which they came.

    Attributes:
        total: robot steps that went wrong; may be more than there are rows.
        reason: (k,) index into ``REASONS``; robot: (k,) its number.
        qpos: (k, 19), qvel: (k, 18), warmstart: (k, 18) as in ``simulation.Body``.
        action, last_action: (k, 12) of the step that went wrong and of the one before it.
        command: (k, 3).
        targets: (k, past, 12) joint targets of that step and of those before it [rad].
        delay: (k,) physics steps until a target takes effect.
        friction, added_mass, kp, kd, joint_friction: (k,) of the robot, as in ``randomisation.Traits``.
        level, column: (k,) tile; step: (k,) of the episode.
    """

    total: Int[Array, ""]
    reason: Int[Array, " k"]
    robot: Int[Array, " k"]
    qpos: Float[Array, "k 19"]
    qvel: Float[Array, "k 18"]
    warmstart: Float[Array, "k 18"]
    action: Float[Array, "k 12"]
    last_action: Float[Array, "k 12"]
    command: Float[Array, "k 3"]
    targets: Float[Array, "k past 12"]
    delay: Int[Array, " k"]
    friction: Float[Array, " k"]
    added_mass: Float[Array, " k"]
    kp: Float[Array, " k"]
    kd: Float[Array, " k"]
    joint_friction: Float[Array, " k"]
    level: Int[Array, " k"]
    column: Int[Array, " k"]
    step: Int[Array, " k"]

    @classmethod
    def none(cls) -> Lost:
        """No robot was lost."""

        def whole() -> Array:
            return jnp.zeros(KEPT, jnp.int32)

        def numbers(*shape: int) -> Array:
            return jnp.zeros((KEPT, *shape), jnp.float32)

        return cls(
            jnp.zeros((), jnp.int32), whole(), whole(), numbers(19), numbers(18), numbers(18), numbers(12),
            numbers(12), numbers(3), numbers(PAST, 12), whole(), numbers(), numbers(), numbers(), numbers(), numbers(),
            whole(), whole(), whole(),
        )  # fmt: skip


def keep_lost(
    lost: Lost,
    wrong: Bool[Array, "reasons n"],
    state: EnvState,
    action: Float[Array, "n 12"],
    targets: Float[Array, "n past 12"],
    delay: Int[Array, " n"],
) -> Lost:
    """Add the robots of a step that went wrong.

    Args:
        wrong: what went wrong with whom, in the order of ``REASONS``.
        action: of the step, as the policy gave it.
        targets, delay: of the step, as ``Simulation.step`` was given them.
    """
    gone, n = wrong.any(0), wrong.shape[1]
    robot = jnp.nonzero(gone, size=KEPT, fill_value=n)[0].astype(jnp.int32)
    # rows beyond the last are dropped: of robots that are none, and of those that come too late
    slot = jnp.where(robot < n, lost.total + jnp.arange(KEPT, dtype=jnp.int32), KEPT)
    values = Lost(
        total=lost.total,
        reason=jnp.argmax(wrong, 0).astype(jnp.int32),
        robot=jnp.arange(n, dtype=jnp.int32),
        qpos=state.body.qpos,
        qvel=state.body.qvel,
        warmstart=state.body.warmstart,
        action=action,
        last_action=state.action,
        command=state.command,
        targets=targets,
        delay=delay,
        **{name: getattr(state.traits, name) for name in TRAITS},
        level=state.level,
        column=state.column,
        step=state.step,
    )
    rows = (
        old.at[slot].set(new.at[robot].get(mode="clip"), mode="drop")
        for old, new in zip(lost[1:], values[1:], strict=True)
    )
    return Lost(lost.total + gone.sum(dtype=jnp.int32), *rows)
