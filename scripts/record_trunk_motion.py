"""Record how a locomotor carries the navigation camera and executes velocities, for a navigator's training.

    python scripts/record_trunk_motion.py vinl/rough [--clutter none paper] [--robots 64] [--seconds 40] [--json FILE]

Prints a table and the settings of configs/nav/motion for each clutter preset. Takes about two minutes on two cores.
"""

from __future__ import annotations

import argparse
import json
import math
import os
from dataclasses import asdict
from pathlib import Path

from trunk_motion import Execution, Sway, describe_sway, fit_execution, record_motion

from vinl.policies.io import load_policy
from vinl.world.clutter import CLUTTER


def print_table(clutter: str, count: int, falls: int, sway: dict[str, Sway], execution: Execution) -> None:
    """The figures of one ground as Markdown."""
    print(f"\n### clutter: {clutter} ({count} robots, {falls} fell)\n")
    print("| trunk | mean | sd of an episode's mean | sd within | autocorrelation at 0.5 s | 1 % to 99 % |")
    print("|---|---|---|---|---|---|")
    for name, s in sway.items():
        f, unit = (1.0, "m") if name == "height" else (180 / math.pi, "deg")
        digits = 4 if name == "height" else 2
        row = [f"{f * x:.{digits}f}" for x in (s.mean, s.offset, s.within)]
        ends = f"{f * s.low:.{digits}f} to {f * s.high:.{digits}f}"
        print(f"| {name} [{unit}] | {' | '.join(row)} | {s.autocorrelation:.2f} | {ends} |")
    print("\n| execution | |\n|---|---|")
    for name, value in asdict(execution).items():
        print(f"| `{name}` | {value:.4f} |")


def print_settings(name: str, clutter: str, sway: dict[str, Sway], execution: Execution) -> None:
    """Settings for configs/nav/motion that say what was recorded on one ground.

    Offsets of an episode are uniform there: their half-width is sqrt(3) standard deviations.
    """
    half = math.sqrt(3)

    def pair(key: str, factor: float = 1.0) -> str:
        return f"[{factor * getattr(sway['roll'], key):.4f}, {factor * getattr(sway['pitch'], key):.4f}]"

    def spread(key: str) -> str:
        mean, wide = getattr(execution, key), 2 * getattr(execution, f"{key}_spread")
        return f"[{mean - wide:.3f}, {mean + wide:.3f}]"

    correlation = (sway["roll"].autocorrelation + sway["pitch"].autocorrelation) / 2
    print(f"\n# recorded from {name}, clutter {clutter}, by scripts/record_trunk_motion.py; radians, metres, seconds")
    print(f"camera:\n  mount_height: {sway['height'].mean:.3f}")
    print("motion:  # pairs are roll and pitch")
    print(f"  tilt: {pair('mean')}")
    print(f"  offset: {pair('offset', half)}")
    print(f"  shake: {pair('within')}")
    print(f"  correlation: {correlation:.2f}")
    print(f"  height_offset: {half * sway['height'].offset:.4f}")
    print(f"  height_shake: {sway['height'].within:.4f}")
    print("execution:")
    print(f"  speed_lag: {execution.speed_lag:.2f}\n  yaw_lag: {execution.yaw_lag:.2f}")
    print(f"  speed_gain: {spread('speed_gain')}")
    print(f"  yaw_gain: {spread('yaw_gain')}")
    for key in ("speed_noise", "yaw_noise", "side_slip"):
        print(f"  {key}: {getattr(execution, key):.4f}")
    print(f"  yaw_drift: {half * execution.yaw_drift + abs(execution.yaw_bias):.4f}")


def main() -> None:
    """Roll out, fit, print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("policy", help="locomotion policy: a shipped name or a folder")
    parser.add_argument("--clutter", nargs="+", choices=tuple(CLUTTER), default=["none", "paper"])
    parser.add_argument("--robots", type=int, default=64, help="on each ground")
    parser.add_argument("--seconds", type=float, default=40.0, help="that each robot walks [s]")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--json", type=Path, help="write the figures here as well")
    options = parser.parse_args()
    policy = load_policy(options.policy)
    figures = {}
    for clutter in options.clutter:
        records = record_motion(policy, clutter, options.robots, options.seconds, options.seed, options.workers)
        sway, execution, falls = describe_sway(records), fit_execution(records), sum(r.fell for r in records)
        print_table(clutter, len(records), falls, sway, execution)
        print_settings(policy.card.name, clutter, sway, execution)
        figures[clutter] = {
            "robots": len(records),
            "falls": falls,
            "trunk": {name: asdict(s) for name, s in sway.items()},
            "execution": asdict(execution),
        }
    if options.json:
        options.json.write_text(json.dumps(figures, indent=2) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
