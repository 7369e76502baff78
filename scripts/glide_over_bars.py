"""What the foothold plan alone would touch: robots without dynamics glide over bars, feet where the plan has them.

python scripts/glide_over_bars.py [setting=value ...], settings of ``GaitConfig``. Prints, for each speed and height of
the bar (0.2 m deep), the fraction of 16 crossings without a foot or shank on it, and of those within reach of the legs.
"""

from __future__ import annotations

import sys

import numpy as np

from vinl.config.errors import InputError
from vinl.config.loader import build_config
from vinl.gait.config import GaitConfig
from vinl.gait.gliding import glide


def main() -> None:
    """Print the table."""
    if {"-h", "--help"} & set(sys.argv[1:]):
        print(__doc__)
        return
    try:
        config = build_config(GaitConfig, {}, sys.argv[1:], source="gait")
    except InputError as error:
        print(f"error: {error}", file=sys.stderr)
        sys.exit(2)
    print("speed [m/s]  bar [m]  clean  clean and in reach")
    for speed in (0.3, 0.5, 0.7):
        for height in (0.05, 0.10, 0.15, 0.20):
            over = glide(config, height, speed, robots=16)
            clean = ~over.foot & ~over.shank
            print(
                f"{speed:11.1f}  {height:7.2f}  {np.mean(clean):5.0%}  {np.mean(clean & over.in_reach):5.0%}",
                flush=True,
            )


if __name__ == "__main__":
    main()
