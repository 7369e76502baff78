"""A film of an episode: the robot from behind, what its cameras see, the map with the path so far."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float, UInt8

from vinl.chain.config import EvaluationConfig
from vinl.chain.records import Episode, name_episode
from vinl.chain.robot import KINDS_OF
from vinl.chain.rollout import InterruptedRunError
from vinl.render.panels import MapPanel, colour_depth, compose, write_caption, write_film
from vinl.render.raytrace import ChaseCamera, RayRenderer, look_at
from vinl.render.scene import BLOCK, FLOOR, WALL, RobotShape, Scene, plan_scene
from vinl.robot.aliengo import CONTROL_DT
from vinl.robot.cameras import LOCOMOTION_CAMERA, NAVIGATION_CAMERA, Camera
from vinl.robot.rotation import matrix_of, yaw_of
from vinl.sensing.depth import DepthCamera
from vinl.world.boxes import Blocks
from vinl.world.floorplan import FloorPlan
from vinl.world.grid import GridFrame, HeightField
from vinl.world.mesh import floorplan_mesh, heightfield_mesh

POSE_DT = 2 * CONTROL_DT
"""Time between two recorded poses [s]."""

FPS = 12.5
"""Pictures a second of a film: every second pose at natural speed."""

MAX_FRAMES = 300
"""A film of more pictures than this (24 s) runs at twice, three times ... the natural speed instead."""

ROBOT_SIZE = (640, 512)
"""Width and height of the picture of the robot as rendered [pixels]; it is shown a quarter larger. 0.1 s a picture."""

_CAMERAS = (LOCOMOTION_CAMERA, NAVIGATION_CAMERA)


@dataclass(frozen=True, eq=False)
class FilmJob:
    """An episode with recorded poses, and the folder for its film."""

    plan: FloorPlan
    episode: Episode
    out: str

    @property
    def name(self) -> str:
        """File name: plan, episode, seed."""
        return name_film(*self.episode.record.key)


def name_film(plan: str, seed: int, episode: int) -> str:
    """File name of the film of an episode."""
    return name_episode(plan, seed, episode) + ".mp4"


def film(job: FilmJob, config: EvaluationConfig, is_stopped: Callable[[], bool] = lambda: False) -> str:
    """Write the film of an episode, whole or not at all, and say what its file is called in the folder. Raises
    ``InterruptedRunError`` if ``is_stopped`` said so."""

    def frames() -> Iterator[UInt8[np.ndarray, "height width 3"]]:
        for frame in draw_frames(job, config):
            if is_stopped():
                raise InterruptedRunError
            yield frame

    write_film(frames(), Path(job.out) / job.name, FPS)
    return job.name


def draw_frames(job: FilmJob, config: EvaluationConfig) -> Iterator[UInt8[np.ndarray, "height width 3"]]:
    """The pictures of a film, one after another."""
    trace, record = job.episode.trace, job.episode.record
    pace = 1 + (len(trace.poses) // 2) // MAX_FRAMES
    chosen = np.arange(0, len(trace.poses), 2 * pace)
    poses = trace.poses[chosen]
    blocks = Blocks(trace.blocks)
    eyes = [_see(job.plan, blocks, camera, poses) for camera in _CAMERAS]
    shape = RobotShape()
    renderer = RayRenderer(plan_scene(job.plan, blocks, goal=record.goal), shape.bodies, shape.names)
    chase = ChaseCamera(renderer)
    map_panel = MapPanel(job.plan, blocks, record, config.success_radius)
    yaw = yaw_of(np, poses[:, 3:7])
    speed = _speeds(trace.poses, yaw_of(np, trace.poses[:, 3:7]))[chosen]
    for k, pose in enumerate(poses):
        time = float(chosen[k]) * POSE_DT
        seen = trace.contacts[trace.contacts[:, 0] <= time]
        picture = renderer.render(chase.follow(pose[:3], float(yaw[k])), *ROBOT_SIZE, *shape.place(pose))
        captions = [
            f"{time:5.1f} s" + (f"   ({pace} x)" if pace > 1 else ""),
            f"command {trace.commands[chosen[k], 0]:.2f} m/s, {trace.commands[chosen[k], 2]:+.2f} rad/s",
            f"speed {speed[k]:.2f} m/s",
            f"contact steps: foot {count_steps(seen, 'foot')}, leg {count_steps(seen, 'leg')}",
            "" if k < len(poses) - 1 else record.end_reason,
        ]
        path = trace.poses[: chosen[k] + 1 : 2, :2]
        yield compose(
            picture,
            [colour_depth(eye[k], camera.far) for eye, camera in zip(eyes, _CAMERAS, strict=True)],
            map_panel.draw(path, seen, pose[:2], float(yaw[k])),
            captions,
        )


def _see(plan: FloorPlan, blocks: Blocks, camera: Camera, poses: np.ndarray) -> Float[np.ndarray, "n h w"]:
    mesh = floorplan_mesh(plan, blocks)
    depth = DepthCamera([mesh], camera).render(
        np.zeros(len(poses), np.int32), poses[:, :3], matrix_of(np, poses[:, 3:7])
    )
    return depth.numpy()


def _speeds(poses: np.ndarray, yaw: np.ndarray) -> np.ndarray:
    """Forward speed [m/s] at each pose, over 0.2 s."""
    step = np.gradient(poses[:, :2], POSE_DT, axis=0) if len(poses) > 1 else np.zeros((len(poses), 2))
    ahead = step[:, 0] * np.cos(yaw) + step[:, 1] * np.sin(yaw)
    return np.convolve(np.pad(ahead, 2, mode="edge"), np.full(5, 0.2), mode="valid")


def count_steps(contacts: np.ndarray, limb: str) -> int:
    """Control steps with a contact of a limb, one of ``KINDS_OF``."""
    return len(np.unique(contacts[np.isin(contacts[:, 1], KINDS_OF[limb]), 0]))


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
    """Film the poses one after another, each with its text, as ``.mp4`` or ``.gif``. From the first that is not finite
    on, the film stands still; pose 0 must be finite."""
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
