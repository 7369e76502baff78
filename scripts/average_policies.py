"""Write the mean of two policies' weights, for two that were trained from one another.

    python scripts/average_policies.py loco runs/student --share 0.35 --out runs/averaged

Measure it before it is shipped (scripts/ship_policy.py, scripts/measure_policy.py).
"""

from __future__ import annotations

import argparse
from pathlib import Path

from vinl.config.errors import InputError
from vinl.policies.average import average_policies
from vinl.policies.io import load_policy, save_policy


def main() -> None:
    """Write the policy folder."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("first", help="shipped name, or folder of a policy or run")
    parser.add_argument("second", help="the same")
    parser.add_argument("--share", type=float, default=0.5, help="of the second, 0 to 1 (default 0.5)")
    parser.add_argument("--out", type=Path, required=True, help="folder to write")
    options = parser.parse_args()
    try:
        network, card = average_policies(load_policy(options.first), load_policy(options.second), options.share)
        print(save_policy(options.out, network, card))
    except InputError as error:
        parser.error(str(error))


if __name__ == "__main__":
    main()
