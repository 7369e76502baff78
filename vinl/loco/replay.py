"""What happened to a robot whose numbers went wrong in training: its last state, stepped again."""

from __future__ import annotations

import zipfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
import yaml
from jaxtyping import Float

from vinl.config.errors import InputError
from vinl.config.loader import build_config
from vinl.loco.config import LocoConfig
from vinl.loco.environment import MAX_SPEED
from vinl.loco.nan_guard import TRAITS, Lost
from vinl.loco.randomisation import Traits, plain_traits
from vinl.loco.simulation import Body, DeviceGround, Simulation, target_age, torque_range
from vinl.robot.aliengo import FOOT_GEOMS, JOINTS, SUBSTEPS
from vinl.world.grid import HeightField
from vinl.world.terrain import build_terrain

SIMULATORS = ("mjx", "mujoco")
"""The simulator of the training, on a CPU, and MuJoCo C with the same model."""

_FIELDS = (*(name for name in Lost._fields if name != "total"), "seed", "iteration", "config")


@dataclass(frozen=True, eq=False)
class LostState:
    """A file of ``not_finite/``.

    Attributes:
        values: the fields of ``nan_guard.Lost`` of one robot, by name.
        reason: what went wrong in the training, a word of ``nan_guard.REASONS``.
    """

    values: dict[str, Any]
    reason: str
    config: LocoConfig

    def describe(self) -> str:
        """Where it comes from, in one line."""
        v = self.values
        kind = self.config.terrain.column_kinds()[int(v["column"])]
        return (
            f"robot {v['robot']}, iteration {v['iteration']}, seed {v['seed']}: {self.reason} went wrong on a tile of "
            f"{kind} (level {v['level']}, column {v['column']}), control step {v['step']} of the episode"
        )


@dataclass(frozen=True, eq=False)
class Replay:
    """A robot's motion, one row a physics step of 5 ms; the first is the saved state.

    Attributes:
        qpos: (t, 19), qvel: (t, 18), acceleration: (t, 18), torque: (t, 12).
        wrong: what went wrong first, in words, and in which row; None: nothing.
    """

    qpos: Float[np.ndarray, "t 19"]
    qvel: Float[np.ndarray, "t 18"]
    acceleration: Float[np.ndarray, "t 18"]
    torque: Float[np.ndarray, "t 12"]
    wrong: tuple[int, str] | None
    field: HeightField


def load_lost(path: str | Path) -> LostState:
    """A state that a training saved.

    Raises:
        InputError: the file is missing, broken or something else.
    """
    path = Path(path)
    if not path.is_file():
        raise InputError(f"{path} does not exist; a training writes such files into its folder not_finite")
    try:
        with np.load(path, allow_pickle=False) as file:
            values = {name: file[name] for name in file.files}
    except (ValueError, OSError, EOFError, zipfile.BadZipFile):
        raise InputError(f"{path} is no saved state of a training") from None
    missing = [name for name in _FIELDS if name not in values]
    if missing:
        raise InputError(f"{path} is no saved state of a training: {', '.join(missing)} is missing")
    text, reason = str(values.pop("config")), str(values.pop("reason"))
    config = build_config(LocoConfig, yaml.safe_load(text) or {}, source=f"{path}: config")
    return LostState(values, reason, config)


def replay(state: LostState, steps: int = 5, simulator: str = "mjx") -> Replay:
    """Step a robot again from its saved state, with the action of the step that went wrong held.

    Args:
        state: from ``load_lost``.
        steps: control steps; it ends earlier where numbers stop to be finite.
        simulator: a word of ``SIMULATORS``.

    Raises:
        InputError: the simulator is unknown.
    """
    if simulator not in SIMULATORS:
        raise InputError(f"--simulator {simulator!r} is unknown; known: {', '.join(SIMULATORS)}")
    terrain = build_terrain(state.config.terrain)
    simulation = Simulation(terrain.ground, state.config.kp, state.config.kd, terrain.blocks, terrain.tall)
    v = state.values
    rows = [(v["qpos"], v["qvel"], np.zeros(18), np.zeros(12))]
    wrong = _look(0, *rows[0], action=v["action"])
    advance = (_mjx_steps if simulator == "mjx" else _mujoco_steps)(simulation, v)
    if all(np.isfinite(x).all() for x in rows[0]):
        for k, row in zip(range(1, steps * SUBSTEPS + 1), advance, strict=False):
            rows.append(row)
            wrong = wrong or _look(k, *row)
            if not all(np.isfinite(x).all() for x in row):
                break
    columns = [np.stack(column) for column in zip(*rows, strict=True)]
    return Replay(*columns, wrong=wrong, field=terrain.ground)


Row = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]


def _traits(v: dict[str, Any]) -> Traits:
    """Of the robot; what is only measured is left out."""
    plain = jax.tree.map(lambda x: x[0], plain_traits(1))
    return plain._replace(**{name: jnp.asarray(v[name], jnp.float32) for name in TRAITS})


def _targets(v: dict[str, Any]) -> Iterator[np.ndarray]:
    """(12,) joint targets [rad] of each physics step, the last action held."""
    targets, k = np.asarray(v["targets"]), 0
    while True:
        yield targets[int(target_age(jnp.asarray(k), jnp.asarray(int(v["delay"]))))]
        k += 1


def _mjx_steps(simulation: Simulation, v: dict[str, Any]) -> Iterator[Row]:
    """Physics steps in MJX, as in the training but for the processor's rounding."""
    body = Body(*(jnp.asarray(v[name], jnp.float32) for name in ("qpos", "qvel", "warmstart")))
    traits = _traits(v)

    def once(ground: DeviceGround, body: Body, target: jax.Array) -> tuple[Body, jax.Array, jax.Array]:
        data = simulation.physics_step(simulation.robot_model(ground, traits), body, target)
        return Body(data.qpos, data.qvel, data.qacc_warmstart), data.qacc, data.actuator_force

    step = jax.jit(once)
    for target in _targets(v):
        body, acceleration, torque = step(simulation.ground, body, jnp.asarray(target, jnp.float32))
        yield tuple(np.asarray(x, np.float64) for x in (body.qpos, body.qvel, acceleration, torque))  # type: ignore[misc]


def _mujoco_steps(simulation: Simulation, v: dict[str, Any]) -> Iterator[Row]:
    """Physics steps in MuJoCo C: spheres on the same height field, float64."""
    model = simulation.model
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_NATIVECCD  # as in chain/scene.py
    for foot in FOOT_GEOMS:
        model.geom(foot).friction[0] = float(v["friction"])
    model.body("trunk").mass[0] += float(v["added_mass"])
    model.actuator_gainprm[:, 0] *= float(v["kp"])
    model.actuator_biasprm[:, 1] *= float(v["kp"])
    model.actuator_biasprm[:, 2] *= float(v["kd"])
    model.dof_frictionloss[:] *= float(v["joint_friction"])
    model.dof_damping[:] *= float(v["joint_friction"])
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:], data.qacc_warmstart[:] = v["qpos"], v["qvel"], v["warmstart"]
    for target in _targets(v):
        data.ctrl[:] = target
        model.actuator_forcerange[:] = torque_range(np, data.qvel[6:])
        mujoco.mj_step(model, data)
        yield data.qpos.copy(), data.qvel.copy(), data.qacc.copy(), data.actuator_force.copy()


_PLACES = ("x", "y", "z", "quaternion w", "quaternion x", "quaternion y", "quaternion z", *JOINTS)
_SPEEDS = ("x", "y", "z", "roll", "pitch", "yaw", *JOINTS)


def _look(
    k: int, qpos: np.ndarray, qvel: np.ndarray, acceleration: np.ndarray, torque: np.ndarray,
    action: np.ndarray | None = None,
) -> tuple[int, str] | None:  # fmt: skip
    """What is wrong with a row, in words."""
    found = [
        f"{what} of {names[j]} is {values[j]}"
        for what, values, names in (
            ("position", qpos, _PLACES),
            ("speed", qvel, _SPEEDS),
            ("acceleration", acceleration, _SPEEDS),
            ("torque", torque, JOINTS),
            ("action", np.zeros(12) if action is None else action, JOINTS),
        )
        for j in np.flatnonzero(~np.isfinite(values))
    ]
    if not found:
        fast = np.flatnonzero(np.abs(qvel) > MAX_SPEED)
        found = [f"speed of {_SPEEDS[j]} is {qvel[j]:.0f}, beyond {MAX_SPEED:.0f}" for j in fast]
    if not found:
        return None
    more = f" (and {len(found) - 1} more)" if len(found) > 1 else ""
    return k, found[0] + more
