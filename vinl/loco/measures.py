"""The figures of a locomotion training: sums over robots and steps, kept on the device, read once an iteration."""

from __future__ import annotations

import math
from dataclasses import fields

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from vinl.loco.config import RewardConfig
from vinl.loco.rewards import Motion, distance2
from vinl.loco.simulation import FEET
from vinl.robot.aliengo import CONTROL_DT, JOINT_SPEED_LIMIT
from vinl.world.grid import BLOCK
from vinl.world.terrain import RESOLUTION, TILE, Terrain

_MEASURE_SIGMA = 0.25
"""Width of the tracking terms in the measures, whatever the reward's: curves of different trainings compare."""

TERMS = tuple(field.name for field in fields(RewardConfig) if field.name not in ("sigma", "floor"))
"""The reward terms, in the order of the configuration."""

MEASURES = (
    "steps", "reward", "linear_tracking", "yaw_tracking", "linear_error2",
    "yaw_error2", "metres", "falls", "timeouts", "episode_steps",
    "foot_block", "shank_block", "foot_wall", "over_block", "covered",
    "landings", "not_finite", "level", "clipped", "crossing",
    "too_fast", "swings", "foot_error2", "swing_hits", "blocked",
)  # fmt: skip
"""Sums over robots and steps, before the reward terms."""


def sum_measures(
    m: Motion,
    level: Int[Array, " n"],
    reward: Float[Array, " n"],
    weighted: dict[str, Float[Array, " n"]],
    clipped: Bool[Array, " n"],
    moved: Float[Array, " n"],
    timeout: Bool[Array, " n"],
    life: Int[Array, " n"],
    broken: Bool[Array, " n"],
    over: Array,
    cover: Array,
) -> Float[Array, " m"]:
    """One step's sums over robots, in the order of ``MEASURES``, then the weighted reward terms."""
    linear2 = jnp.sum((m.command[:, :2] - m.linear[:, :2]) ** 2, 1)
    yaw2 = (m.command[:, 2] - m.angular[:, 2]) ** 2
    values = {
        "steps": jnp.ones(len(reward)),
        "reward": reward,
        "linear_tracking": jnp.exp(-linear2 / _MEASURE_SIGMA),
        "yaw_tracking": jnp.exp(-yaw2 / _MEASURE_SIGMA),
        "linear_error2": linear2,
        "yaw_error2": yaw2,
        "metres": moved * ~broken,
        "falls": m.fallen,
        "timeouts": timeout,
        "episode_steps": life * (m.fallen | timeout),
        "foot_block": m.contacts.foot_block.any(1),
        "shank_block": m.contacts.shank_block.any(1),
        "foot_wall": m.contacts.foot_wall.any(1),
        "over_block": over,
        "covered": cover,
        "landings": m.landed.sum(1),
        "not_finite": broken,
        "level": level,
        "clipped": clipped,
        "crossing": m.contacts.crossing,
        "too_fast": (jnp.abs(m.joint_speed) > jnp.asarray(JOINT_SPEED_LIMIT, jnp.float32)).any(1),
        "swings": m.steps.swing.sum(1),
        "foot_error2": jnp.sum(distance2(m.steps.path_error), 1),
        "swing_hits": (m.steps.middle & m.contacts.foot).sum(1),
        "blocked": m.steps.blocked.sum(1),
    }
    ordered = [values[name] for name in MEASURES] + [weighted[name] for name in TERMS]
    return jnp.stack([jnp.sum(jnp.nan_to_num(value), dtype=jnp.float32) for value in ordered])


def average_sums(sums: Float[np.ndarray, " m"]) -> dict[str, float]:
    """Sums over many steps as means: per step, second, metre or episode, as the name says."""
    names = [*MEASURES, *(f"reward/{name}" for name in TERMS)]
    raw = dict(zip(names, sums.tolist(), strict=True))
    steps, metres = max(raw["steps"], 1.0), max(raw["metres"], 1e-6)
    ends = max(raw["falls"] + raw["timeouts"], 1.0)
    return {
        "reward": raw["reward"] / steps / CONTROL_DT,
        **{name: raw[name] / steps for name in ("linear_tracking", "yaw_tracking", "level", "clipped", "too_fast")},
        "leg_crossing": raw["crossing"] / steps,
        "linear_rmse": math.sqrt(raw["linear_error2"] / steps),
        "yaw_rmse": math.sqrt(raw["yaw_error2"] / steps),
        "falls_per_minute": raw["falls"] / (steps * CONTROL_DT / 60),
        "speed": raw["metres"] / (steps * CONTROL_DT),
        "episode_seconds": raw["episode_steps"] / ends * CONTROL_DT,
        "foot_block_per_m": raw["foot_block"] / metres,
        "shank_block_per_m": raw["shank_block"] / metres,
        "foot_wall_per_m": raw["foot_wall"] / metres,
        "trunk_over_blocks": raw["over_block"] / max(raw["covered"], 1.0),
        "stride": FEET * raw["metres"] / max(raw["landings"], 1.0),
        "foot_rmse": math.sqrt(raw["foot_error2"] / max(raw["swings"], 1.0)),
        "swing_hits": raw["swing_hits"] / max(raw["swings"], 1.0),
        "plan_blocked": raw["blocked"] / max(raw["swings"], 1.0),
        "not_finite": raw["not_finite"],
        **{name: value / steps / CONTROL_DT for name, value in raw.items() if name.startswith("reward/")},
    }


def tile_cover(terrain: Terrain) -> Float[np.ndarray, "levels columns"]:
    """The fraction of every tile that blocks cover."""
    covered, half = np.zeros(terrain.starts.shape[:2], np.float32), round(TILE / RESOLUTION / 2)
    for k, c in np.ndindex(covered.shape):
        i, j = terrain.ground.frame.cell(terrain.starts[k, c, :2])
        covered[k, c] = (terrain.ground.labels[i - half : i + half, j - half : j + half] == BLOCK).mean()
    return covered
