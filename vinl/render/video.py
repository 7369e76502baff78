"""A film of an episode: the robot from behind, what its cameras see, the map with the path so far."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float, UInt8

from vinl.chain.config import EvaluationConfig
from vinl.chain.records import Episode
from vinl.chain.rollout import InterruptedRunError
from vinl.render.chase_camera import ChaseCamera
from vinl.render.film_file import write_film
from vinl.render.panels import MapPanel, colour_depth, compose
from vinl.render.raytrace import RayRenderer
from vinl.render.robot_shape import RobotShape
from vinl.render.scene import plan_scene
from vinl.robot.aliengo import CONTROL_DT
from vinl.robot.cameras import LOCOMOTION_CAMERA, NAVIGATION_CAMERA, Camera
from vinl.robot.rotation import matrix_of, yaw_of
from vinl.sensing.depth import DepthCamera
from vinl.world.boxes import Blocks
from vinl.world.floorplan import FloorPlan
from vinl.world.mesh import floorplan_mesh

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
    return re.sub(r"[^\w.-]+", "_", f"{plan}_episode{episode}_seed{seed}") + ".mp4"


def film(job: FilmJob, config: EvaluationConfig, is_stopped: Callable[[], bool] = lambda: False) -> str:
    """Write the film of an episode, whole or not at all.

    Returns:
        The file's name in the folder.

    Raises:
        InterruptedRunError: ``is_stopped`` said so.
    """

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
            f"contact steps: foot {_count_steps(seen, (0, 1))}, leg {_count_steps(seen, (2, 3))}",
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


def _count_steps(contacts: np.ndarray, kinds: tuple[int, ...]) -> int:
    """Control steps with a contact of one of the kinds."""
    return len(np.unique(contacts[np.isin(contacts[:, 1], kinds), 0]))
