"""Record how a locomotor carries the navigation camera and executes velocities, for a navigator's training.

    python scripts/record_trunk_motion.py vinl/rough [--clutter none paper] [--robots 64] [--seconds 40] [--json FILE]

Prints a table for each clutter preset, and a YAML snippet for configs/nav that covers them all. Takes about two minutes
on two cores.
"""

from __future__ import annotations

import argparse
import json
import math
import os
from dataclasses import asdict
from pathlib import Path

from vinl.evaluation.motion_fit import Execution, Sway, describe_sway, fit_execution
from vinl.evaluation.trunk_motion import record_motion
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


def print_snippet(name: str, sway: list[dict[str, Sway]], execution: list[Execution]) -> None:
    """Settings that cover all grounds: the largest motion and noise, the range of the gains."""
    tilt = max(s[k].within for s in sway for k in ("roll", "pitch"))
    offset = max(s[k].offset for s in sway for k in ("roll", "pitch"))
    pitch = sum(s["pitch"].mean for s in sway) / len(sway)
    height = sum(s["height"].mean for s in sway) / len(sway)
    half = math.sqrt(3)  # half-width of a uniform distribution over its standard deviation

    def mean(key: str) -> float:
        return sum(getattr(e, key) for e in execution) / len(execution)

    def spread(key: str) -> str:
        ends = [getattr(e, key) + sign * 2 * getattr(e, f"{key}_spread") for e in execution for sign in (-1, 1)]
        return f"[{min(ends):.3f}, {max(ends):.3f}]"

    print(f"\n# recorded from {name} by scripts/record_trunk_motion.py; radians, metres, seconds")
    print("camera:")
    print(f"  mount_height: {height:.3f} # the trunk walks at this height")
    print(f"  # the trunk pitches by {math.degrees(pitch):+.2f} deg on average (nose down is positive)")
    print("motion:")
    print(f"  offset: {half * offset + abs(pitch):.4f}")
    print(f"  shake: {tilt:.4f}")
    print(f"  height_offset: {half * max(s['height'].offset for s in sway):.4f}")
    print(f"  height_shake: {max(s['height'].within for s in sway):.4f}")
    print("  with_trunk: true")
    print("execution:")
    print(f"  lag: {mean('lag'):.3f}")
    print(f"  speed_gain: {spread('speed_gain')}")
    print(f"  yaw_gain: {spread('yaw_gain')}")
    for key in ("speed_noise", "yaw_noise", "side_slip"):
        print(f"  {key}: {max(getattr(e, key) for e in execution):.3f}")
    print(f"  yaw_drift: {half * mean('yaw_drift') + abs(mean('yaw_bias')):.3f}")


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
    sways, executions, figures = [], [], {}
    for clutter in options.clutter:
        records = record_motion(policy, clutter, options.robots, options.seconds, options.seed, options.workers)
        sway, execution, falls = describe_sway(records), fit_execution(records), sum(r.fell for r in records)
        print_table(clutter, len(records), falls, sway, execution)
        sways.append(sway)
        executions.append(execution)
        figures[clutter] = {
            "robots": len(records),
            "falls": falls,
            "trunk": {name: asdict(s) for name, s in sway.items()},
            "execution": asdict(execution),
        }
    print_snippet(policy.card.name, sways, executions)
    if options.json:
        options.json.write_text(json.dumps(figures, indent=2) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
