"""Can a robot that has walked against a wall still turn? For ``execution.give_way`` of the navigation environment.

    python scripts/turn_at_walls.py [loco ...] [--push 1] [--speed 0.3] [--robots 32]

Robots stand before walls and furniture of a shipped home, within 30 deg of facing them, walk forward until
they have pushed for a while, and then turn on the spot at 1.04 rad/s for 2 s, half of them to the left, in MuJoCo C.
Prints how far they turned, how far they were pushed back or aside meanwhile, and how many fell.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from jaxtyping import Float
from scipy.ndimage import distance_transform_edt

from vinl.chain.config import EvaluationConfig
from vinl.chain.episode import EpisodeSetup, draw_routes, draw_setup
from vinl.chain.navigators.base import Task
from vinl.chain.rollout import run_episodes
from vinl.policies.io import load_policy
from vinl.robot.cameras import Camera
from vinl.world.clutter import CLUTTER
from vinl.world.floorplan import FloorPlan
from vinl.world.readers import load_floorplan

TURN = 1.04
"""Yaw rate [rad/s]."""

GAP = 0.3
"""From the nose to the obstacle in front, at most [m]."""

TURNING = 4
"""Decisions of 0.5 s to turn in."""


class PushAndTurn:
    """Forward for some decisions, then on the spot to the left or right.

    Attributes:
        camera: none.
        poses: x, y, yaw at each decision.
    """

    camera: Camera | None = None

    def __init__(self, speed: float, push: float) -> None:
        self.speed, self.poses = speed, list[np.ndarray]()
        self.forward = round(2 * (GAP / speed + push))

    def reset(self, episodes: Sequence[Task]) -> None:
        """See ``Navigator.reset``."""
        self.poses = []

    def act(self, observation: dict[str, Any]) -> Float[np.ndarray, "n 2"]:
        """See ``Navigator.act``."""
        n = len(observation["pose"])
        self.poses.append(observation["pose"].copy())
        if len(self.poses) <= self.forward:
            return np.tile([self.speed, 0.0], (n, 1))
        return np.stack([np.zeros(n), np.where(np.arange(n) % 2 == 0, TURN, -TURN)], 1)


def stand_before_walls(plan: FloorPlan, robots: int, config: EvaluationConfig) -> list[EpisodeSetup]:
    """Robots 0.55-0.65 m from the nearest obstacle, within 30 deg of facing it, without clutter."""
    rng = np.random.default_rng(0)
    away, nearest = distance_transform_edt(plan.free, return_indices=True)  # pyright: ignore[reportGeneralTypeIssues]
    near = np.argwhere((away * plan.frame.resolution > 0.55) & (away * plan.frame.resolution < 0.65))
    setup = draw_setup(plan, draw_routes(plan, 1, config)[0], 0, 0, CLUTTER["none"], config)
    setups = []
    for k, cell in enumerate(rng.permutation(near)[:robots]):
        at, wall = plan.frame.xy(cell), plan.frame.xy(nearest[:, cell[0], cell[1]])
        yaw = float(np.arctan2(*(wall - at)[::-1]) + rng.uniform(-np.pi / 6, np.pi / 6))
        setups.append(replace(setup, episode=k, yaw=yaw, route=replace(setup.route, start=at, yaw=yaw)))
    return setups


def main() -> None:
    """Push, turn and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("policies", nargs="*", default=["loco", "teacher"])
    parser.add_argument("--push", type=float, default=1.0, help="how long they push once they are there [s]")
    parser.add_argument("--speed", type=float, default=0.3, help="forward [m/s]")
    parser.add_argument("--robots", type=int, default=32)
    options = parser.parse_args()
    navigator = PushAndTurn(options.speed, options.push)
    config = replace(EvaluationConfig(), time_limit=0.5 * (navigator.forward + TURNING) + 0.1)
    plan = load_floorplan("family_home")
    for name in options.policies:
        episodes = run_episodes(
            plan, stand_before_walls(plan, options.robots, config), load_policy(name), navigator, config
        )
        begun = navigator.poses[navigator.forward]
        standing = np.array([e.record.end_reason != "fall" for e in episodes])
        poses = np.stack(navigator.poses[navigator.forward :])
        turned = np.abs(np.unwrap(poses[..., 2], axis=0)[-1] - poses[0, :, 2])[standing]
        moved = np.linalg.norm(poses[..., :2] - begun[:, :2], axis=2).max(0)[standing]
        fell, well = options.robots - standing.sum(), np.mean(turned > 0.8 * TURN * TURNING / 2)
        print(
            f"{name}: {fell} of {options.robots} fell; of the others {well:.0%} turned by more than 80 % of what was "
            f"asked for, {np.mean(turned < 0.3):.0%} by less than 0.3 rad (median {np.median(turned):.1f}); moved by "
            f"{np.median(moved):.2f} m meanwhile (median), {np.quantile(moved, 0.9):.2f} m (nine in ten)"
        )


if __name__ == "__main__":
    main()
