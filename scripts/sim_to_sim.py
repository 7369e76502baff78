"""The same policy on the same block course in MJX (height field) and in MuJoCo C (boxes), side by side.

    python scripts/sim_to_sim.py teacher [--robots 64] [--seconds 20] [--density 1.0] [--commands turns] [--out FILE]

Needs jax and mujoco-mjx (the ``train`` extra). Starts and commands are the same, robot by robot; a robot that falls
starts afresh. Neither side has noise, pushes or other masses; the feet's friction is the model's.
"""

from __future__ import annotations

import argparse
import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float
from rich import box
from rich.console import Console
from rich.table import Table

from vinl.chain.choose import check_locomotion_policy
from vinl.chain.workers import one_thread
from vinl.courses.block_contacts import BlockContacts
from vinl.courses.courses import COMMANDS, Course, Start, choose_commands, command_ranges
from vinl.courses.grounds import Ground, GroundConfig, build_ground
from vinl.courses.robot_records import RobotRecord, aggregate_robots
from vinl.courses.trial import BoxHerd, Herd, run_trial
from vinl.loco.randomisation import plain_traits
from vinl.loco.simulation import PAST, Body, Simulation
from vinl.policies.io import load_policy
from vinl.policies.policy import Policy
from vinl.robot.aliengo import CONTROL_DT, STANDING_HEIGHT, home_qpos
from vinl.world.endings import MAX_TILT

FIGURES = (
    ("fall_count", "falls"),
    ("falls", "share of robots that fell"),
    ("foot_block_per_m", "feet on blocks per metre"),
    ("foot_front_block_per_m", "front feet"),
    ("foot_rear_block_per_m", "rear feet"),
    ("leg_block_per_m", "legs on blocks per metre"),
    ("linear_velocity_rmse", "linear RMSE [m/s]"),
    ("yaw_rate_rmse", "yaw RMSE [rad/s]"),
    ("trunk_over_blocks", "trunk over blocks"),
    ("metres", "metres"),
)


class FieldHerd:
    """Robots in MJX, where blocks are bumps of a height field and bodies are spheres; see ``herd.Herd``."""

    strain = None
    """It does not tell what a step took."""

    def __init__(self, ground: Ground, kp: float, kd: float, n: int) -> None:
        self._simulation = Simulation(ground.field, kp, kd, ground.blocks)
        self.qpos, self.qvel = np.zeros((n, 19)), np.zeros((n, 18))
        self.touches, self.fallen = BlockContacts.none(n), np.zeros(n, bool)
        self._warm = np.zeros((n, 18), np.float32)
        foot = self._simulation.model.geom("FL_foot").id
        friction = jnp.full(n, float(self._simulation.model.geom_friction[foot, 0]))
        self._traits, self._delay = plain_traits(n)._replace(friction=friction), jnp.zeros(n, jnp.int32)
        self._step = jax.jit(self._simulation.step)

    def start(self, robot: int, start: Start) -> None:
        """Put a robot somewhere, at rest."""
        self.qpos[robot] = home_qpos(start.x, start.y, start.ground + STANDING_HEIGHT, start.yaw)
        self.qpos[robot, 7:] = start.joints
        self.qvel[robot], self._warm[robot] = 0, 0

    def step(self, targets: Float[np.ndarray, "n 12"]) -> None:
        """One control step to joint targets [rad]."""
        body = Body(*(jnp.asarray(x, jnp.float32) for x in (self.qpos, self.qvel, self._warm)))
        past = jnp.repeat(jnp.asarray(targets, jnp.float32)[:, None], PAST, 1)
        body, contacts, _ = self._step(self._simulation.ground, body, past, self._delay, self._traits)
        # copies: JAX's own arrays may not be written to
        self.qpos[:], self.qvel[:], self._warm[:] = (np.asarray(x) for x in body)
        upright = 1 - 2 * (self.qpos[:, 4] ** 2 + self.qpos[:, 5] ** 2)
        broken = ~np.isfinite(self.qpos).all(1)
        self.fallen = np.asarray(contacts.trunk_down) | (upright < np.cos(MAX_TILT)) | broken
        self.touches = self.touches._replace(
            feet=np.asarray(contacts.foot_block), legs=np.asarray(contacts.shank_block)
        )


def measure(herd: Herd, ground: Ground, courses: list[Course], policy: Policy) -> tuple[list[RobotRecord], Any]:
    """Records and figures of one simulator."""
    with one_thread():
        records = run_trial(herd, ground, courses, policy)
    return records, aggregate_robots(records, covered=ground.covered())


def compare(policy: Policy, config: GroundConfig, commands: str, robots: int, seconds: float) -> dict[str, Any]:
    """Both simulators' figures, by name."""
    ground, steps = build_ground(config), round(seconds / CONTROL_DT)
    ranges, found = command_ranges(commands, [policy]), {}
    herds: dict[str, Herd] = {
        "mjx": FieldHerd(ground, config.kp, config.kd, robots),
        "mujoco": BoxHerd(ground.model, robots),
    }
    for name, herd in herds.items():
        courses = [Course(ground, ranges, config.seed, k, steps) for k in range(robots)]
        records, figures = measure(herd, ground, courses, policy)
        found[name] = {"aggregate": figures, "robots": [asdict(r) for r in records]}
    return found


def print_table(console: Console, found: dict[str, Any], name: str) -> None:
    """Both sides and their ratio."""
    table = Table(title=name, box=box.SIMPLE_HEAD, pad_edge=False)
    table.add_column("figure")
    for title in ("MJX", "MuJoCo C", "MJX / C"):
        table.add_column(title, justify="right")
    a, b = found["mjx"]["aggregate"], found["mujoco"]["aggregate"]
    for key, title in FIGURES:
        cells = []
        for side in (a, b):
            interval = side["ci95"].get(key)
            spread = f" ({interval[0]:.3g} to {interval[1]:.3g})" if interval else ""
            cells.append("-" if side[key] is None else f"{side[key]:.3g}{spread}")
        table.add_row(title, *cells, f"{a[key] / b[key]:.2f}" if a[key] and b[key] else "-")
    console.print(table)


def main() -> None:
    """Run both and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("policy", help="a shipped policy's name, or a policy folder")
    parser.add_argument("--robots", type=int, default=64)
    parser.add_argument("--seconds", type=float, default=20.0, help="[s]")
    parser.add_argument("--density", type=float, default=1.0, help="blocks per m2")
    parser.add_argument("--commands", choices=COMMANDS, default=None, help="turns by default")
    parser.add_argument("--seed", type=int, default=0, help="of blocks, starts and commands")
    parser.add_argument("--out", type=Path, help="JSON file with the figures and every robot's record")
    options = parser.parse_args()
    policy = load_policy(options.policy)
    check_locomotion_policy(policy)
    action = policy.card.action
    config = GroundConfig("blocks", options.density, None, options.seed, float(action["kp"]), float(action["kd"]))
    commands = choose_commands(options.commands, "blocks")
    found = compare(policy, config, commands, options.robots, options.seconds)
    print_table(Console(), found, f"{options.policy}, {options.density:g} blocks per m2, commands {commands}")
    if options.out:
        options.out.parent.mkdir(parents=True, exist_ok=True)
        options.out.write_text(json.dumps({"config": vars(options) | {"out": str(options.out)}, **found}, indent=1))


if __name__ == "__main__":
    main()
