"""A film of a robot on a piece of training ground, seen from the side."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from jaxtyping import Float, UInt8

from vinl.render.film_file import write_caption, write_film
from vinl.render.raytrace import RayRenderer, look_at
from vinl.render.robot_shape import RobotShape
from vinl.render.scene import BLOCK, FLOOR, WALL, Scene
from vinl.world.grid import GridFrame, HeightField
from vinl.world.mesh import heightfield_mesh

SIZE = (640, 480)
"""Width and height [pixels]."""

RATE = 10
"""Pictures a second."""

_REACH = 2.5
_SQUARE = 5
_LAST = RATE  # the last picture stays for a second
_NOWHERE = GridFrame(1000.0, 1000.0, 1.0, (2, 2))
_COLOURS = np.array([FLOOR, BLOCK, WALL])


def film_state(poses: Float[np.ndarray, "t 19"], texts: list[str], field: HeightField, path: Path) -> None:
    """Film the poses one after another; from the first that is not finite on, the film stands still.

    Args:
        poses: (t, 19) position [m] and quaternion of the trunk, joint angles [rad]; the first is finite.
        texts: one for every pose.
        field: the ground.
        path: ``.mp4`` or ``.gif``.
    """
    write_film(draw_state_frames(poses, texts, field), path, RATE)


def draw_state_frames(
    poses: Float[np.ndarray, "t 19"], texts: list[str], field: HeightField
) -> Iterator[UInt8[np.ndarray, "height width 3"]]:
    """The pictures."""
    shape, middle = RobotShape(), poses[0, :3]
    renderer = RayRenderer(_cut_scene(field, middle[:2]), shape.bodies, shape.names)
    view = look_at(middle + np.array([1.1, -1.5, 0.7]), middle - np.array([0.0, 0.0, 0.1]))
    pose = poses[0]
    for k in range(len(poses) + _LAST):
        row = min(k, len(poses) - 1)
        seen = np.isfinite(poses[row]).all() and np.abs(poses[row, :3] - middle).max() < 20
        pose = poses[row] if seen else pose
        frame = renderer.render(view, *SIZE, *shape.place(pose), hfov=math.radians(52))
        yield write_caption(frame, texts[row])


def _cut_scene(field: HeightField, middle: Float[np.ndarray, " 2"]) -> Scene:
    """The ground around a point, in squares of 0.25 m; blocks and walls have colours of their own."""
    f, reach = field.frame, round(_REACH / field.frame.resolution)
    row, column = (int(x) for x in f.cell(middle))
    i = slice(max(row - reach, 0), min(row + reach + 1, f.shape[0]))
    j = slice(max(column - reach, 0), min(column + reach + 1, f.shape[1]))
    heights, labels = field.heights[i, j], field.labels[i, j]
    x, y = f.xy(np.array([i.start, j.start]))
    vertices, faces = heightfield_mesh(heights, GridFrame(float(x), float(y), f.resolution, heights.shape))
    label = np.maximum.reduce([labels[:-1, :-1], labels[1:, :-1], labels[:-1, 1:], labels[1:, 1:]])
    squares = np.add.outer(np.arange(label.shape[0]) // _SQUARE, np.arange(label.shape[1]) // _SQUARE) % 2
    colours = _COLOURS[label] * (1 - 0.12 * squares[..., None])
    painted = np.repeat(colours.reshape(-1, 3), 2, axis=0).astype(np.float32)  # two triangles a cell
    return Scene(vertices, faces, painted, _NOWHERE)
