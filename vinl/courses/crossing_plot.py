"""Where the feet go over a bar, drawn beside its profile."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from vinl.courses.crossing import CrossingTrace
from vinl.robot.aliengo import FOOT_RADIUS, LEGS
from vinl.robot.kinematics import foot_positions

_COLOURS = ("#1f77b4", "#ff7f0e")


def draw_feet(traces: Mapping[str, Sequence[CrossingTrace]], height: float, depth: float, path: Path) -> None:
    """Height of the feet along the corridor, front and rear apart, one row of panels for each policy.

    A line is the lowest point of a foot: the first crossing strong, the others faint. Red: it touches the bar.

    Args:
        traces: crossings by policy.
        height, depth: of the bar [m].
        path: of the picture.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    from matplotlib.patches import Rectangle

    figure = Figure(figsize=(11, 2.6 * len(traces) + 0.4), layout="constrained")
    FigureCanvasAgg(figure)
    panels = figure.subplots(len(traces), 2, sharex=True, sharey=True, squeeze=False)
    for row, (name, crossings) in zip(panels, traces.items(), strict=True):
        for axes, pair, title in zip(row, ((0, 1), (2, 3)), ("front feet", "rear feet"), strict=True):
            axes.add_patch(Rectangle((-depth / 2, 0), depth, height, color="0.75"))
            for k, trace in enumerate(crossings):
                feet = foot_positions(np, trace.qpos)
                for foot, colour in zip(pair, _COLOURS, strict=True):
                    x, z = feet[:, foot, 0], feet[:, foot, 2] - FOOT_RADIUS
                    strength = {"linewidth": 1.8} if k == 0 else {"linewidth": 0.7, "alpha": 0.35}
                    axes.plot(x, z, color=colour, label=LEGS[foot] if k == 0 else None, **strength)
                    hit = trace.feet[:, foot]
                    axes.plot(x[hit], z[hit], "o", color="red", markersize=3)
            touched = sum(int(trace.feet[:, list(pair)].any(1).sum()) for trace in crossings)
            axes.set_title(f"{name}, {title}: {touched} steps on the bar in {len(crossings)} crossings", fontsize=10)
            axes.legend(frameon=False, loc="upper right")
            axes.spines[["top", "right"]].set_visible(False)
            axes.set_xlim(-0.8, 0.8)
            axes.set_ylim(-0.02, max(0.45, height + 0.2))
        row[0].set_ylabel("lowest point of the foot [m]")
    for axes in panels[-1]:
        axes.set_xlabel("from the middle of the bar [m]")
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=120)
