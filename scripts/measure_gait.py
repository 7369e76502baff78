"""How long and how high a locomotor's strides are on level floor, straight ahead, by speed, in MuJoCo C.

    python scripts/measure_gait.py rough teacher [--speeds 0.3 0.5 0.7 1.0] [--seconds 8]

A stride is a foot's way from where it leaves the floor to where it comes down, its lift the highest point of that way.
"""

from __future__ import annotations

import argparse
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from rich.console import Console
from rich.table import Table

from vinl.chain.robot import Robot, Robots
from vinl.chain.workers import one_thread
from vinl.courses.grounds import GroundConfig, build_ground
from vinl.courses.trial import controller_on_course
from vinl.policies.io import load_policy
from vinl.policies.policy import Policy
from vinl.robot.aliengo import CONTROL_DT, DEFAULT_POSE, FOOT_RADIUS, foot_positions
from vinl.robot.rotation import yaw_of

AIR = 0.008
"""A foot higher than this above the floor is in the air [m]: the simulator lets feet sink in by a few millimetres."""

SETTLE = 2.0
"""Seconds at the start that do not count."""


class Swing(NamedTuple):
    """One foot's way through the air: seconds, length and highest point [m]."""

    seconds: float
    length: float
    lift: float


def walk(policy: Policy, speeds: list[float], seconds: float) -> Float[np.ndarray, "t n 4 3"]:
    """Where the feet of robots are that walk at these speeds [m/s], at every control step after ``SETTLE`` [m]."""
    action = policy.card.action
    ground = build_ground(GroundConfig("blocks", 0.0, None, 0, float(action["kp"]), float(action["kd"])))
    each = [Robot(ground.model) for _ in speeds]
    for robot in each:
        robot.spawn(-seconds / 2, 0.0, 0.0, DEFAULT_POSE)
    robots, places = Robots(each), []
    with one_thread():
        controller = controller_on_course(policy, ground, len(speeds))
        controller.reset(len(speeds))
        for _ in range(round((SETTLE + seconds) / CONTROL_DT)):
            turn = np.clip(-1.5 * yaw_of(np, robots.qpos[:, 3:7]), -0.5, 0.5)
            command = np.stack([speeds, np.zeros(len(speeds)), turn], 1)
            robots.step(controller.step(robots.qpos, robots.qvel, command))
            places.append(foot_positions(np, robots.qpos))
    return np.stack(places)[round(SETTLE / CONTROL_DT) :]


def swings(foot: Float[np.ndarray, "t 3"]) -> list[Swing]:
    """The whole swings in the track of one foot."""
    high = foot[:, 2] - FOOT_RADIUS
    change = np.diff((high > AIR).astype(int))
    ups, downs = np.flatnonzero(change == 1), np.flatnonzero(change == -1)
    pairs = [(up, downs[downs > up][0]) for up in ups if (downs > up).any()]
    return [
        Swing(
            (down - up) * CONTROL_DT,
            float(np.linalg.norm(foot[down, :2] - foot[up, :2])),
            float(high[up : down + 1].max()),
        )
        for up, down in pairs
    ]


def main() -> None:
    """Walk and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("policies", nargs="+", help="names of shipped policies, or policy folders")
    parser.add_argument("--speeds", type=float, nargs="+", default=[0.3, 0.5, 0.7, 1.0], help="[m/s]")
    parser.add_argument("--seconds", type=float, default=8.0, help="[s]")
    options = parser.parse_args()
    table = Table("policy", "speed", "", "stride", "lift", "in the air", "landings/s", box=None)
    for name in options.policies:
        tracks = walk(load_policy(name), options.speeds, options.seconds)
        for k, speed in enumerate(options.speeds):
            for side, feet in (("front", (0, 1)), ("rear", (2, 3))):
                found = [swing for leg in feet for swing in swings(tracks[:, k, leg])]
                if not found:
                    table.add_row(name, f"{speed:g} m/s", side, "never lifted")
                    continue
                seconds, length, lift = np.mean(found, 0)
                rate = len(found) / 2 / options.seconds
                table.add_row(
                    name, f"{speed:g} m/s", side, f"{length:.2f} m", f"{lift:.3f} m", f"{seconds:.2f} s", f"{rate:.1f}"
                )
    Console().print(table)


if __name__ == "__main__":
    main()
