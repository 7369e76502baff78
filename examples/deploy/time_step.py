"""How long the policies take on this computer, on one core: python time_step.py loco.onnx nav.onnx"""

import sys
import time

import numpy as np
from controllers import Locomotion, Navigation

STEPS = 500


def time_steps(step):
    """Median and 99th percentile of a step [ms]: processor time of this thread, so that others do not count."""
    spent = []
    for _ in range(STEPS):
        begin = time.thread_time()
        step()
        spent.append(1000 * (time.thread_time() - begin))
    return np.percentile(spent, [50, 99])


def main(locomotion, navigation):
    """Print one row a policy."""
    walk, steer, random = Locomotion(locomotion), Navigation(navigation), np.random.default_rng(0)

    def see(policy):
        camera = policy.about["camera"]
        return random.uniform(0, camera["far"], (camera["height"], camera["width"]))

    near, ahead = see(walk), see(steer)
    gravity, command = np.array([0, 0, -1]), np.array([0.5, 0, 0])
    joints, goal = np.array(walk.about["default_pose"]), np.array([5.0, 1.0])
    for policy, step in (
        (walk, lambda: walk.step(np.zeros(3), gravity, joints, np.zeros(12), command, near)),
        (steer, lambda: steer.step(random.uniform(-1, 1, 3), goal, ahead)),
    ):
        median, slow = time_steps(step)
        about = policy.about
        print(f"{about['name']:10} {median:6.2f} ms, 99 % under {slow:.2f} ms, of {1000 * about['period']:.0f} ms")


if __name__ == "__main__":
    main(*sys.argv[1:])
