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

KEPT = (
    "iteration",
    "samples",
    "seconds",
    "samples_per_second",
    "update_seconds",
    "level",
    "linear_tracking",
    "yaw_tracking",
    "linear_rmse",
    "yaw_rmse",
    "falls_per_minute",
    "reward",
    "clipped",
    "action_std",
    "learning_rate",
)
PANELS = (
    ("level", "mean level (0-9)"),
    ("linear_tracking", "velocity tracking, exp(-error² / 0.25)"),
    ("falls_per_minute", "falls per robot-minute"),
    ("samples_per_second", "samples per second"),
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
    thin = [{key: row[key] for key in KEPT} for row in rows if row["iteration"] % 10 == 0 or row is rows[0]]
    options.out.with_suffix(".jsonl").write_text("".join(json.dumps(row) + "\n" for row in thin))
    figure, axes = plt.subplots(2, 2, figsize=(9, 5.4), sharex=True, layout="constrained")
    for (name, title), axis in zip(PANELS, axes.flat, strict=True):
        axis.plot(minutes[1:], [row[name] for row in rows[1:]], color="#2b6cb0", linewidth=1)
        axis.set_title(title, fontsize=10, loc="left")
        axis.grid(alpha=0.3)
        axis.spines[["top", "right"]].set_visible(False)
        if name == "linear_tracking":
            axis.plot(minutes[1:], [row["yaw_tracking"] for row in rows[1:]], color="#dd8b20", linewidth=1)
            axis.legend(["in the plane", "turning"], frameon=False, fontsize=8)
    for axis in axes[1]:
        axis.set_xlabel("minutes of training")
    figure.savefig(options.out.with_suffix(".png"), dpi=110)
    print(f"{options.out.with_suffix('.png')}: {len(rows)} iterations, {rows[-1]['samples'] / 1e6:.1f} M samples, "
          f"{total / 60:.1f} minutes")  # fmt: skip


if __name__ == "__main__":
    main()
