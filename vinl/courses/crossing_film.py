"""A film of robots that step over a bar, seen from the side, at half the natural speed."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np
from jaxtyping import UInt8
from PIL import Image, ImageDraw, ImageFont

from vinl.courses.bars import WIDTH
from vinl.courses.crossing import CrossingTrace
from vinl.render.film_file import write_film
from vinl.render.raytrace import RayRenderer, look_at
from vinl.render.robot_shape import RobotShape
from vinl.render.scene import BLOCK, plain_scene
from vinl.robot.aliengo import CONTROL_DT
from vinl.world.boxes import Boxes
from vinl.world.grid import GridFrame

SIZE = (640, 320)
"""Width and height of each policy's picture [pixels]."""

SLOWER = 2
"""How much slower than life."""

_SHOWN = 0.85
_GIF_EVERY = 2
_TOUCHED = (0.9, 0.1, 0.1)
_EYE, _AIM, _FIELD = (-1.75, 0.62), 0.22, math.radians(46)
"""The camera stands so far aside and so high [m], high enough that the legs of the far side are seen behind those of
the near one; it looks at the robot at this height [m]."""


def film_crossings(traces: Mapping[str, CrossingTrace], height: float, depth: float, path: Path) -> None:
    """Film one crossing of each policy, one above another; the bar turns red while it is touched.

    Args:
        traces: one crossing by policy.
        height, depth: of the bar [m].
        path: ``.mp4`` or ``.gif``; a GIF has half the pictures.
    """
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
    font = ImageFont.load_default(18)
    shown = {name: _near_bar(trace) for name, trace in traces.items()}
    for k in range(0, max(map(len, shown.values())), every):
        rows = []
        for name, steps in shown.items():
            trace, step = traces[name], steps[min(k, len(steps) - 1)]
            touched = trace.feet[step].any() or trace.legs[step].any() or trace.trunk[step]
            pose = trace.qpos[step]
            view = look_at((pose[0] * 0.85, *_EYE), (pose[0] * 0.85, 0.0, _AIM))
            frame = renderers[int(touched)].render(view, *SIZE, *shape.place(pose), hfov=_FIELD)
            picture = Image.fromarray(frame)
            feet, legs, trunk = (
                int(flags[: step + 1].reshape(step + 1, -1).any(1).sum())
                for flags in (trace.feet, trace.legs, trace.trunk)
            )
            text = f"{name}, {100 * height:g} cm    steps on the bar: feet {feet}, legs {legs}, trunk {trunk}"
            ImageDraw.Draw(picture).text((12, 8), text, fill=(30, 30, 30), font=font)
            rows.append(np.asarray(picture))
        yield np.concatenate(rows)


def _near_bar(trace: CrossingTrace) -> list[int]:
    """Control steps at which the trunk is near the bar."""
    near = np.flatnonzero(np.abs(trace.qpos[:, 0]) < _SHOWN)
    return near.tolist() or [len(trace.qpos) - 1]
