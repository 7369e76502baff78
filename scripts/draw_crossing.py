"""Film the best of many crossings of one block, and draw the height of the feet in all of them, for the docs.

    python scripts/draw_crossing.py out/crossing teacher [--height 0.12] [--speed 0.6] [--crossings 32]

writes ``out/crossing.gif`` and ``out/crossing.png`` and prints how many crossings touched nothing. The
best is the one with the fewest control steps of feet and legs on the block; its line in the picture is the strong one.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from PIL import Image

from vinl.courses.crossing import Crossing, cross_block, describe_steps, draw_steps
from vinl.courses.crossing_film import film_steps
from vinl.policies.io import load_policy


def count_touches(way: Crossing) -> tuple[bool, int]:
    """Whether the robot came not across, and the control steps on the block: to sort by."""
    return not way.done, int(way.foot_touches.any(1).sum() + way.leg_touches.any(1).sum())


def main() -> None:
    """Cross, film and draw."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=Path, help="path without suffix")
    parser.add_argument("policy")
    parser.add_argument("--height", type=float, default=0.12, help="[m]")
    parser.add_argument("--speed", type=float, default=0.6, help="[m/s]")
    parser.add_argument("--crossings", type=int, default=32)
    options = parser.parse_args()
    ways = sorted(
        cross_block(load_policy(options.policy), options.height, options.speed, options.crossings), key=count_touches
    )
    name = Path(options.policy).name
    print(f"{name}: {describe_steps(ways)}; the best: {describe_steps(ways[:1])}")
    film_steps({name: ways[:1]}, options.height, options.out.with_suffix(".gif"))
    picture = options.out.with_suffix(".png")
    draw_steps({name: ways}, options.height, picture)
    Image.open(picture).convert("RGB").quantize(64).save(picture, optimize=True)


if __name__ == "__main__":
    main()
