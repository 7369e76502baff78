"""Film the best of many crossings of one bar, and draw the height of the feet in all of them, for the docs.

    python scripts/draw_crossing.py docs/images/crossing teacher [--height 0.1] [--speed 0.5] [--crossings 32]

writes ``docs/images/crossing.gif`` and ``docs/images/crossing.png`` and prints how many crossings touched nothing. The
best is the one with the fewest control steps of feet, legs and trunk on the bar; its line in the picture is the strong
one. The crossings are those of ``vinl eval-loco --terrain bars``.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from PIL import Image

from vinl.chain.workers import one_thread
from vinl.courses.crossing import BarConfig, Crossing, build_corridor, cross_bar
from vinl.courses.evaluate import GROUP
from vinl.courses.evaluate_crossings import aggregate_crossings
from vinl.courses.report import draw_feet, film_crossings
from vinl.policies.io import load_policy


def main() -> None:
    """Cross, film and draw."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=Path, help="path without suffix")
    parser.add_argument("policy")
    parser.add_argument("--height", type=float, default=0.1, help="[m]")
    parser.add_argument("--depth", type=float, default=0.2, help="[m]")
    parser.add_argument("--speed", type=float, default=0.5, help="[m/s]")
    parser.add_argument("--crossings", type=int, default=32)
    parser.add_argument("--seed", type=int, default=0, help="of the starts")
    options = parser.parse_args()
    policy = load_policy(options.policy)
    gains = (float(policy.card.action[name]) for name in ("kp", "kd"))
    bar = BarConfig(options.height, options.depth, options.speed, options.seed, *gains)
    ground, crossings = build_corridor(bar), list[Crossing]()
    with one_thread():
        for first in range(0, options.crossings, GROUP):
            crossings += cross_bar(policy, bar, ground, range(first, min(first + GROUP, options.crossings)))
    crossings.sort(key=lambda crossing: (not crossing.record.finished, crossing.record.touches))
    figures = aggregate_crossings([crossing.record for crossing in crossings])
    chosen = ("crossings", "clean_crossings", "clean_foot_crossings", "finished", "falls")
    name, best = Path(options.policy).name, crossings[0]
    print(f"{name}: { ({key: figures[key] for key in chosen}) }; the best: {best.record.touches} steps on the bar")
    film_crossings({name: best.trace}, options.height, options.depth, options.out.with_suffix(".gif"))
    picture = options.out.with_suffix(".png")
    draw_feet({name: [crossing.trace for crossing in crossings]}, options.height, options.depth, picture)
    Image.open(picture).convert("RGB").quantize(64).save(picture, optimize=True)


if __name__ == "__main__":
    main()
