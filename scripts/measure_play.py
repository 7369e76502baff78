"""How fast ``vinl play`` can go on one core: ``taskset -c 0 python scripts/measure_play.py``.

A live session is stepped as the page's thread does it, depth images four times a second included. Printed are simulated
seconds for each second of the processor: the real-time factor of a core that does nothing else; and the cost in units
of the physics of a robot that stands, which hardly depends on how fast the machine is just now.
"""

from __future__ import annotations

import argparse
import time

import numpy as np
import torch

from vinl.chain.config import EvaluationConfig
from vinl.chain.episode import draw_routes
from vinl.chain.robot import Robot
from vinl.chain.scene import build_scene
from vinl.robot.aliengo import CONTROL_DT, DEFAULT_POSE
from vinl.viewer.live import LiveChain
from vinl.viewer.session import LOOK_EVERY, Reset, SetGoal
from vinl.viewer.world import open_home
from vinl.world.boxes import Boxes
from vinl.world.readers import load_floorplan

STANDS = 10
"""Steps of the robot that stands, for each of the chain's: what slows the machine down slows both."""


def main() -> None:
    """Walk towards a far goal, begin anew whenever it is reached, and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--plan", default="harbour_flat")
    parser.add_argument("--loco", default="loco")
    parser.add_argument("--nav", default="nav")
    parser.add_argument("--seconds", type=float, default=20.0, help="of simulated time (default: %(default)s)")
    options = parser.parse_args()
    torch.set_num_threads(1)
    rules = EvaluationConfig()
    plan = load_floorplan(options.plan)
    chain = LiveChain(open_home(plan, "paper", 0, rules), options.loco, options.nav, rules)
    route = draw_routes(plan, 1, rules)[0]
    goal = SetGoal(*route.goal.tolist())
    standing = Robot(build_scene(plan.boxes, Boxes.empty()))
    standing.spawn(float(route.start[0]), float(route.start[1]), 0.0, DEFAULT_POSE)
    looks, costs, stands, steps = round(LOOK_EVERY / CONTROL_DT), [], [], round(options.seconds / CONTROL_DT)
    for k in range(-50, steps):  # what is compiled at its first use does not count
        if chain.snapshot(False).state in ("standing", "reached", "fallen"):
            chain.apply(Reset())
            chain.apply(goal)
        began = time.process_time()
        chain.step()
        chain.snapshot(k % looks == 0)
        stepped = time.process_time()
        for _ in range(STANDS):
            standing.step(DEFAULT_POSE)
        if k >= 0:
            costs.append(stepped - began)
            stands.append((time.process_time() - stepped) / STANDS)
    cost = sum(costs) / steps
    middle, slow = np.quantile(costs, [0.5, 0.99])
    print(f"{options.loco}, {options.nav} in {options.plan}: real-time factor {CONTROL_DT / cost:.1f}")
    print(f"a step of 20 ms costs {1000 * cost:.1f} ms; median {1000 * middle:.1f}, 99 % under {1000 * slow:.1f}")
    print(f"that is {cost / (sum(stands) / steps):.0f} times the physics of a robot that stands")
    print(f"{chain.snapshot(False).distance_m:.1f} m walked since the last start")


if __name__ == "__main__":
    main()
