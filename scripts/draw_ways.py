"""Draw where robots walk on the block course, from above: over the blocks or around them.

    python scripts/draw_ways.py docs/research/images/ways.png rough teacher [--robots 24] [--seconds 20]

One panel for each policy; all have the same starts and commands. Needs nothing of the ``train`` extra.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from jaxtyping import Float
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.patches import Polygon

from vinl.chain.workers import one_thread
from vinl.courses.courses import Course, command_ranges
from vinl.courses.grounds import Ground, GroundConfig, build_ground
from vinl.courses.robot_records import aggregate_robots
from vinl.courses.trial import BoxHerd, run_trial
from vinl.policies.io import load_policy
from vinl.policies.policy import Policy
from vinl.robot.aliengo import CONTROL_DT

WINDOW = 4.0
"""Half the side of the square that is shown [m]."""


class WatchedHerd(BoxHerd):
    """Remembers where the trunks were."""

    def __init__(self, ground: Ground, n: int) -> None:
        super().__init__(ground.model, n)
        self.places: list[Float[np.ndarray, "n 2"]] = []
        self.hits: list[np.ndarray] = []

    def step(self, targets: Float[np.ndarray, "n 12"], rows: Sequence[int] | None = None) -> None:
        """One control step."""
        super().step(targets, rows)
        self.places.append(self.qpos[:, :2].copy())
        self.hits.append(np.concatenate([self.touches.feet, self.touches.legs], 1))


def walk(policy: Policy, ground: Ground, robots: int, seconds: float, seed: int) -> tuple[WatchedHerd, float, float]:
    """The robots, their steps with a foot on a block per metre, and how much they walk over blocks."""
    ranges, steps = command_ranges("turns", [policy]), round(seconds / CONTROL_DT)
    courses = [Course(ground, ranges, seed, k, steps) for k in range(robots)]
    herd = WatchedHerd(ground, robots)
    with one_thread():
        figures = aggregate_robots(run_trial(herd, ground, courses, policy), covered=ground.covered())
    return herd, figures["foot_block_per_m"], figures["trunk_over_blocks"]


def main() -> None:
    """Walk and draw."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=Path)
    parser.add_argument("policies", nargs="+")
    parser.add_argument("--robots", type=int, default=24)
    parser.add_argument("--seconds", type=float, default=20.0, help="[s]")
    parser.add_argument("--density", type=float, default=1.0, help="blocks per m2")
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    figure = Figure(figsize=(4.6 * len(options.policies), 5.0), layout="constrained")
    FigureCanvasAgg(figure)
    for axes, name in zip(figure.subplots(1, len(options.policies), squeeze=False)[0], options.policies, strict=True):
        policy = load_policy(name)
        gains = float(policy.card.action["kp"]), float(policy.card.action["kd"])
        ground = build_ground(GroundConfig("blocks", options.density, None, options.seed, *gains))
        herd, feet, over = walk(policy, ground, options.robots, options.seconds, options.seed)
        for corners in ground.blocks.boxes().corners():
            axes.add_patch(Polygon(corners, facecolor="0.75", edgecolor="none"))
        places, hits = np.stack(herd.places), np.stack(herd.hits)
        for k in range(options.robots):
            pieces = np.stack([places[:-1, k], places[1:, k]], 1)
            whole = np.linalg.norm(pieces[:, 0] - pieces[:, 1], axis=1) < 0.2  # not from a fall to the next start
            axes.add_collection(LineCollection(list(pieces[whole]), colors="#1f77b4", linewidths=0.9))
            axes.plot(*places[hits[:, k].any(1), k].T, ".", color="#d62728", markersize=2.5)
        axes.set_title(f"{name}: feet on blocks {feet:.2f} per metre, over blocks {over:.2f}", fontsize=10)
        axes.set_xlim(-WINDOW, WINDOW)
        axes.set_ylim(-WINDOW, WINDOW)
        axes.set_aspect("equal")
        axes.set_xlabel("x [m]")
    options.out.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(options.out, dpi=110)


if __name__ == "__main__":
    main()
