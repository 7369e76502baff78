"""Pictures of robots that step over a bar: a film, and how their feet went."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np
from jaxtyping import UInt8

from vinl.config.words import count_things
from vinl.courses.crossing import WIDTH, CrossingTrace
from vinl.render.panels import write_caption, write_film
from vinl.render.raytrace import RayRenderer, look_at
from vinl.render.scene import BLOCK, RobotShape, plain_scene
from vinl.robot.aliengo import CONTROL_DT, FOOT_RADIUS, LEGS, foot_positions
from vinl.world.boxes import Boxes
from vinl.world.grid import GridFrame

SIZE = (640, 320)
"""Width and height of each policy's picture [pixels]."""

SLOWER = 2
"""How much slower than life."""

_FOOT_COLOURS = ("#1f77b4", "#ff7f0e")
_NEAR = 0.85
_GIF_EVERY = 2
_TOUCHED = (0.9, 0.1, 0.1)
_EYE, _AIM, _FIELD = (-1.75, 0.62), 0.22, math.radians(46)
"""The camera stands so far aside and so high [m], high enough that the legs of the far side are seen behind those of
the near one; it looks at the robot at this height [m]."""


def film_crossings(traces: Mapping[str, CrossingTrace], height: float, depth: float, path: Path) -> None:
    """Film one crossing of each policy, one above another, as ``.mp4``, or ``.gif`` with half the pictures; the bar, of
    this height and depth [m], turns red while it is touched."""
    every = _GIF_EVERY if path.suffix == ".gif" else 1
    write_film(draw_frames(traces, height, depth, every), path, round(1 / CONTROL_DT / SLOWER) / every)


def draw_frames(
    traces: Mapping[str, CrossingTrace], height: float, depth: float, every: int = 1
) -> Iterator[UInt8[np.ndarray, "height width 3"]]:
    """The pictures, one for every so many control steps while a robot is near the bar."""
    shape, floor = RobotShape(), GridFrame(-6.0, -6.0, 1.0, (13, 13))
    bar = Boxes(np.array([[0.0, 0.0, np.pi / 2, WIDTH, depth, 0.0, height]]))
    renderers = [
        RayRenderer(plain_scene(bar, [colour], floor, checker=0.25), shape.bodies, shape.names)
        for colour in (BLOCK, _TOUCHED)
    ]
    shown = {name: _near_bar(trace) for name, trace in traces.items()}
    for k in range(0, max(map(len, shown.values())), every):
        rows = []
        for name, steps in shown.items():
            trace, step = traces[name], steps[min(k, len(steps) - 1)]
            touched = trace.feet[step].any() or trace.legs[step].any() or trace.trunk[step]
            pose = trace.qpos[step]
            view = look_at((pose[0] * 0.85, *_EYE), (pose[0] * 0.85, 0.0, _AIM))
            frame = renderers[int(touched)].render(view, *SIZE, *shape.place(pose), hfov=_FIELD)
            feet, legs, trunk = (
                int(flags[: step + 1].reshape(step + 1, -1).any(1).sum())
                for flags in (trace.feet, trace.legs, trace.trunk)
            )
            text = f"{name}, {100 * height:g} cm    steps on the bar: feet {feet}, legs {legs}, trunk {trunk}"
            rows.append(write_caption(frame, text))
        yield np.concatenate(rows)


def _near_bar(trace: CrossingTrace) -> list[int]:
    """Control steps at which the trunk is near the bar."""
    near = np.flatnonzero(np.abs(trace.qpos[:, 0]) < _NEAR)
    return near.tolist() or [len(trace.qpos) - 1]


def draw_feet(traces: Mapping[str, Sequence[CrossingTrace]], height: float, depth: float, path: Path) -> None:
    """Height of the feet along the corridor with a bar of this height and depth [m], front and rear apart, one row of
    panels for each policy.

    A line is the lowest point of a foot: the first crossing strong, the others faint. Red: it touches the bar.
    """
    from matplotlib.figure import Figure
    from matplotlib.patches import Rectangle

    figure = Figure(figsize=(11, 2.6 * len(traces) + 0.4), layout="constrained")
    panels = figure.subplots(len(traces), 2, sharex=True, sharey=True, squeeze=False)
    for row, (name, crossings) in zip(panels, traces.items(), strict=True):
        for axes, pair, title in zip(row, ((0, 1), (2, 3)), ("front feet", "rear feet"), strict=True):
            axes.add_patch(Rectangle((-depth / 2, 0), depth, height, color="0.75"))
            for k, trace in enumerate(crossings):
                feet = foot_positions(np, trace.qpos)
                for foot, colour in zip(pair, _FOOT_COLOURS, strict=True):
                    x, z = feet[:, foot, 0], feet[:, foot, 2] - FOOT_RADIUS
                    strength = {"linewidth": 1.8} if k == 0 else {"linewidth": 0.7, "alpha": 0.35}
                    axes.plot(x, z, color=colour, label=LEGS[foot] if k == 0 else None, **strength)
                    hit = trace.feet[:, foot]
                    axes.plot(x[hit], z[hit], "o", color="red", markersize=3)
            touched = sum(int(trace.feet[:, list(pair)].any(1).sum()) for trace in crossings)
            axes.set_title(
                f"{name}, {title}: {touched} steps on the bar in {count_things(len(crossings), 'crossing')}",
                fontsize=10,
            )
            axes.legend(frameon=False, loc="upper right")
            axes.spines[["top", "right"]].set_visible(False)
            axes.set_xlim(-0.8, 0.8)
            axes.set_ylim(-0.02, max(0.45, height + 0.2))
        row[0].set_ylabel("lowest point of the foot [m]")
    for axes in panels[-1]:
        axes.set_xlabel("from the middle of the bar [m]")
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=120)
