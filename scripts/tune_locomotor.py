"""Change what a trained locomotor does with its command: velocity feedback, and how detours bend it.

    python scripts/tune_locomotor.py runs/teacher-mean --forward 0.6 --detour turning=1.7 --out runs/teacher

With feedback it acts as if it were told command + gain x (command - velocity).

A student stands behind its teacher's actor: train it from the teacher that has the feedback. Measure what comes out
before it is shipped (scripts/ship_policy.py, scripts/measure_policy.py).
"""

from __future__ import annotations

import argparse
from pathlib import Path

from vinl.config.errors import InputError
from vinl.policies.card import change_detour
from vinl.policies.feedback import add_feedback
from vinl.policies.io import load_policy, save_policy


def main() -> None:
    """Write the policy folder."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("policy", help="shipped name, or folder of a policy or run")
    for name in ("forward", "sideways", "yaw-rate"):
        parser.add_argument(f"--{name}", type=float, default=0.0, metavar="GAIN", help="0: as it was (default)")
    parser.add_argument(
        "--detour", nargs="*", metavar="KEY=VALUE", help="fields of vinl.sensing.detour.DetourConfig; none: the default"
    )
    parser.add_argument("--out", type=Path, required=True, help="folder to write")
    options = parser.parse_args()
    gains = (options.forward, options.sideways, options.yaw_rate)
    try:
        policy = load_policy(options.policy)
        network, card = policy.network, policy.card
        if any(gains):
            network, card = add_feedback(policy, *gains)
        if options.detour is not None:
            card = change_detour(card, options.detour)
        print(save_policy(options.out, network, card))
    except InputError as error:
        parser.error(str(error))


if __name__ == "__main__":
    main()
