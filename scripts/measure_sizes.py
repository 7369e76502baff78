"""GPU memory and speed of a training by its number of robots, as rows of a table:

    python scripts/measure_sizes.py train-loco --stage 1
    python scripts/measure_sizes.py train-nav homes.count=3000 --num-envs 512 1024

Each size trains a few iterations in a process of its own, which takes memory as it needs it; what the card holds beside
it counts too. Without a GPU the memory is a dash.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

SIZES = (512, 1024, 2048, 4096, 8192)
SKIPPED = 2
"""First iterations that do not count: they compile."""


def used_memory() -> float | None:
    """What the first card holds [GB]; None without one."""
    try:
        ask = ["nvidia-smi", "--query-gpu=memory.used", "--format=csv,noheader,nounits", "--id=0"]
        return int(subprocess.run(ask, capture_output=True, text=True, check=True).stdout) * 2**20 / 1e9
    except (OSError, subprocess.CalledProcessError, ValueError):
        return None


def measure(training: list[str], robots: int, iterations: int, folder: Path) -> tuple[float | None, float | None]:
    """Most memory [GB] and median samples a second of a training; None for what there is none of."""
    command = [sys.executable, "-m", "vinl", *training, "--num-envs", str(robots), "--iterations", str(iterations)]
    most = used_memory()
    process = subprocess.Popen(
        [*command, "--out", str(folder)],
        stdout=subprocess.DEVNULL,
        env={**os.environ, "XLA_PYTHON_CLIENT_PREALLOCATE": "false"},
    )
    while process.poll() is None:
        now = used_memory()
        most = now if most is None or now is None else max(most, now)
        time.sleep(0.5)
    if process.returncode:
        return most, None
    rows = [json.loads(line) for line in (folder / "metrics.jsonl").read_text().splitlines()]
    return most, statistics.median(row["samples_per_second"] for row in rows[SKIPPED:])


def main() -> None:
    """Print a row for each size."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("training", choices=("train-loco", "train-nav"))
    parser.add_argument("--num-envs", type=int, nargs="+", default=SIZES, help="(default: %(default)s)")
    parser.add_argument("--iterations", type=int, default=8, help="of each training (default: %(default)s)")
    options, rest = parser.parse_known_args()
    if options.iterations <= SKIPPED:
        parser.error(f"--iterations must be more than {SKIPPED}: the first ones compile")
    print(f"| `--num-envs` of `vinl {' '.join([options.training, *rest])}` | GPU memory | samples/s |\n|---|---|---|")
    for robots in options.num_envs:
        with tempfile.TemporaryDirectory() as scratch:
            training = [options.training, *rest]
            memory, speed = measure(training, robots, options.iterations, Path(scratch) / "run")
        gigabytes = "-" if memory is None else f"{memory:.1f} GB"
        print(f"| {robots:,} | {gigabytes} | {'does not fit' if speed is None else f'{speed:,.0f}'} |", flush=True)


if __name__ == "__main__":
    main()
