"""Draw the learning curve of a training run and keep a thinned copy of its metrics.

python scripts/plot_training.py runs/rough docs/curves/rough
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

PANELS = {
    "level": "mean level (0-9)",
    "linear_tracking": "velocity tracking, exp(-error² / 0.25)",
    "falls_per_minute": "falls per robot-minute",
    "foot_block_per_m": "feet and shanks on blocks, control steps per metre",
    "stride": "stride: way between two landings of a foot [m]",
    "trunk_over_blocks": "time above blocks / the share of ground they cover",
    "loss/map_error": "squared error of the map / squared heights",
    "success": "success",
    "spl": "SPL",
    "collisions": "cancelled steps of an episode",
    "action_std": "spread of the actions",
    "samples_per_second": "samples per second",
}
"""Figures and titles; those that a run has are drawn."""

SECOND = {"linear_tracking": ("yaw_tracking", "in the plane", "turning"),
          "foot_block_per_m": ("shank_block_per_m", "feet", "shanks")}  # fmt: skip
"""A second line in the panel of the first."""

KEPT = (
    *("iteration", "samples", "seconds", "samples_per_second", "update_seconds", "reward", "clipped", "learning_rate"),
    *("linear_rmse", "yaw_rmse", "soft_spl", "stuck", "loss/code", "loss/action", "loss/value", "loss/kl"),
    *PANELS,
    *(name for name, _, _ in SECOND.values()),
)


def main() -> None:
    """Write ``OUT.jsonl`` (every tenth iteration) and ``OUT.png``."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("run", type=Path, help="folder of the run")
    parser.add_argument("out", type=Path, help="path without suffix")
    options = parser.parse_args()
    rows = [json.loads(line) for line in (options.run / "metrics.jsonl").read_text().splitlines()]
    minutes, total = [], 0.0
    for row in rows:
        total += row["seconds"]
        minutes.append(total / 60)
    options.out.parent.mkdir(parents=True, exist_ok=True)
    thin = [
        {key: row[key] for key in KEPT if key in row} for row in rows if row["iteration"] % 10 == 0 or row is rows[0]
    ]
    options.out.with_suffix(".jsonl").write_text("".join(json.dumps(row) + "\n" for row in thin))
    shown = [name for name in PANELS if np.ptp([row[name] for row in rows[1:] if name in row] or [0.0]) > 0.01]
    figure, axes = plt.subplots(
        -(-len(shown) // 2), 2, figsize=(9, 2.7 * -(-len(shown) // 2)), sharex=True, layout="constrained", squeeze=False
    )
    for name, axis in zip(shown, axes.flat, strict=False):
        lines = (name, *SECOND.get(name, ())[:1])
        for line, colour in zip(lines, ("#2b6cb0", "#dd8b20"), strict=False):
            # the first iterations are wild
            points = [(m, row[line]) for m, row in zip(minutes[3:], rows[3:], strict=True) if line in row]
            axis.plot(*zip(*points, strict=True), color=colour, linewidth=1)
        axis.set_title(PANELS[name], fontsize=10, loc="left")
        axis.grid(alpha=0.3)
        axis.spines[["top", "right"]].set_visible(False)
        if name in SECOND:
            axis.legend(SECOND[name][1:], frameon=False, fontsize=8)
    for axis in axes.flat[len(shown) :]:
        axis.remove()
    for axis in axes[-1]:
        axis.set_xlabel("minutes of training")
    figure.savefig(options.out.with_suffix(".png"), dpi=110)
    print(f"{options.out.with_suffix('.png')}: {len(rows)} iterations, {rows[-1]['samples'] / 1e6:.1f} M samples, "
          f"{total / 60:.1f} minutes")  # fmt: skip


if __name__ == "__main__":
    main()
