"""Give a locomotion policy velocity feedback: it acts as if it were told command + gain x (command - velocity).

    python scripts/add_feedback.py runs/teacher-mean --forward 0.4 --sideways 0.2 --yaw-rate 0.2 --out runs/teacher

A student stands behind its teacher's actor: train it from the teacher that has the feedback. Measure what comes out
before it is shipped (scripts/ship_policy.py, scripts/measure_policy.py).
"""

from __future__ import annotations

import argparse
from pathlib import Path

from vinl.config.errors import InputError
from vinl.policies.feedback import add_feedback
from vinl.policies.io import load_policy, save_policy


def main() -> None:
    """Write the policy folder."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("policy", help="shipped name, or folder of a policy or run")
    for name in ("forward", "sideways", "yaw-rate"):
        parser.add_argument(f"--{name}", type=float, default=0.0, metavar="GAIN", help="0: as it was (default)")
    parser.add_argument("--out", type=Path, required=True, help="folder to write")
    options = parser.parse_args()
    try:
        network, card = add_feedback(load_policy(options.policy), options.forward, options.sideways, options.yaw_rate)
        print(save_policy(options.out, network, card))
    except InputError as error:
        parser.error(str(error))


if __name__ == "__main__":
    main()
