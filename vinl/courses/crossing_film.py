"""A film of robots that step over a block, seen from the side, at half the natural speed."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np
from jaxtyping import UInt8
from PIL import Image, ImageDraw, ImageFont

from vinl.courses.crossing import ACROSS, DEPTH, Crossing
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
_TOUCH = (0.9, 0.1, 0.1)


def film_steps(ways: Mapping[str, list[Crossing]], height: float, path: Path) -> None:
    """Film the first crossing of each policy, one above another; the block turns red while it is touched.

    Args:
        ways: crossings by name.
        height: of the block [m].
        path: ``.mp4`` or ``.gif``; a GIF has half the pictures.
    """
    every = _GIF_EVERY if path.suffix == ".gif" else 1
    write_film(draw_steps_frames(ways, height, every), path, round(1 / CONTROL_DT / SLOWER) / every)


def draw_steps_frames(
    ways: Mapping[str, list[Crossing]], height: float, every: int = 1
) -> Iterator[UInt8[np.ndarray, "height width 3"]]:
    """The pictures, one for every so many control steps while a robot is near the block."""
    shape, floor = RobotShape(), GridFrame(-6.0, -6.0, 1.0, (13, 13))
    block = Boxes(np.array([[0.0, 0.0, np.pi / 2, ACROSS, DEPTH, 0.0, height]]))
    renderers = [
        RayRenderer(plain_scene(block, [colour], floor, checker=0.25), shape.bodies, shape.names)
        for colour in (BLOCK, _TOUCH)
    ]
    font = ImageFont.load_default(18)
    shown = {name: _near_block(crossings[0]) for name, crossings in ways.items()}
    for k in range(0, max(map(len, shown.values())), every):
        rows = []
        for name, steps in shown.items():
            way, step = ways[name][0], steps[min(k, len(steps) - 1)]
            touched = way.foot_touches[step].any() or way.leg_touches[step].any()
            pose = way.qpos[step]
            view = look_at((pose[0] * 0.85, -1.75, 0.5), (pose[0] * 0.85, 0.0, 0.24))
            frame = renderers[int(touched)].render(view, *SIZE, *shape.place(pose), hfov=math.radians(46))
            picture = Image.fromarray(frame)
            before = way.foot_touches[: step + 1].any(1).sum(), way.leg_touches[: step + 1].any(1).sum()
            text = f"{name}    steps on the block: feet {before[0]}, legs {before[1]}"
            ImageDraw.Draw(picture).text((12, 8), text, fill=(30, 30, 30), font=font)
            rows.append(np.asarray(picture))
        yield np.concatenate(rows)


def _near_block(way: Crossing) -> list[int]:
    """Control steps at which the trunk is near the block."""
    near = np.flatnonzero(np.abs(way.qpos[:, 0]) < _SHOWN)
    return near.tolist() or [len(way.qpos) - 1]
