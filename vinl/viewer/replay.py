"""A recorded episode as the source of a session: it plays, stops, and goes to any time."""

from __future__ import annotations

import mujoco
import numpy as np
from jaxtyping import Float

from vinl.benchmark.recordings import Recordings
from vinl.chain.depth_cameras import DepthCameras, open_depth_cameras
from vinl.config.errors import InputError
from vinl.render.video import POSE_DT, count_steps
from vinl.robot.aliengo import FOOT_GEOMS
from vinl.robot.cameras import LOCOMOTION_CAMERA, NAVIGATION_CAMERA
from vinl.robot.model import robot_spec
from vinl.robot.rotation import wrap_angle, yaw_of
from vinl.viewer.live import CONTACT_MEMORY, look_through
from vinl.viewer.session import DepthImage, OpenEpisode, Request, Reset, Seek, Snapshot
from vinl.viewer.world import World
from vinl.world.boxes import Blocks

_CONTACT_HEIGHT = 0.06
"""Recordings keep where contacts were from above only; they are drawn at this height [m]."""

_PATH_EVERY = 2


class Replay:
    """Plays recorded episodes, ``number`` first. Raises ``InputError`` if there is no such episode."""

    dt = POSE_DT
    """Time between two recorded poses [s]."""

    def __init__(self, shelf: Recordings, number: int = 0) -> None:
        self._shelf = shelf
        self._model = robot_spec("primitives").compile()
        self._data = mujoco.MjData(self._model)
        self._feet = [int(self._model.geom(name).id) for name in FOOT_GEOMS]
        self._open(number)

    def apply(self, request: Request) -> str:
        """See ``Source.apply``."""
        match request:
            case Reset():
                self._frame = 0
            case Seek(time):
                self._frame = int(np.clip(round(time / POSE_DT), 0, len(self._poses) - 1))
            case OpenEpisode(number):
                self._open(number)
                return self._shelf.labels[number]
            case _:
                raise InputError(f"{type(request).__name__} is for a live robot, this is a recording")
        return ""

    def step(self) -> bool:
        """The next pose, after the last one the first; whether it is the last."""
        self._frame = (self._frame + 1) % len(self._poses)
        return self._frame == len(self._poses) - 1

    def snapshot(self, look: bool) -> Snapshot:
        """See ``Source.snapshot``."""
        k, qpos = self._frame, self._poses[self._frame]
        time = k * POSE_DT
        if look or not self._images:
            self._images = look_through(self._cameras, qpos[None])
        self._data.qpos[:] = qpos
        mujoco.mj_kinematics(self._model, self._data)
        record, trace = self._episode.record, self._episode.trace
        seen = trace.contacts[trace.contacts[:, 0] <= time + POSE_DT / 2]
        latest = seen[seen[:, 0] > time - CONTACT_MEMORY]
        return Snapshot(
            world=self._world,
            time_s=time,
            state="recorded",
            qpos=qpos.copy(),
            velocity=self._velocity(),
            command=trace.commands[k].copy(),
            goal=np.array(record.goal),
            path=self._poses[: k + 1 : _PATH_EVERY, :2],
            distance_m=float(self._walked[k]),
            contacts=np.column_stack([latest, np.full(len(latest), _CONTACT_HEIGHT)]),
            contact_steps=(count_steps(seen, "foot"), count_steps(seen, "leg"), count_steps(seen, "trunk")),
            feet=self._data.geom_xpos[self._feet].copy(),
            foot_forces=np.zeros(4),
            images=self._images,
            duration_s=(len(self._poses) - 1) * POSE_DT,
        )

    def _open(self, number: int) -> None:
        if not 0 <= number < len(self._shelf.labels):
            raise InputError(f"--episode {number}: there are episodes 0 to {len(self._shelf.labels) - 1}")
        plan, self._episode = self._shelf.open(number)
        trace, record = self._episode.trace, self._episode.record
        self._poses: np.ndarray = trace.poses
        start = np.array([*record.start, record.yaw])
        self._world = World(plan, Blocks(trace.blocks), start, self._poses[0, 7:])
        self._cameras: dict[str, DepthCameras] = {
            camera.name: open_depth_cameras(plan, [self._world.blocks], camera)
            for camera in (LOCOMOTION_CAMERA, NAVIGATION_CAMERA)
        }
        steps = np.linalg.norm(np.diff(self._poses[:, :2], axis=0), axis=1)
        self._walked = np.concatenate([[0.0], steps.cumsum()])
        self._frame, self._images = 0, dict[str, DepthImage]()

    def _velocity(self) -> Float[np.ndarray, "3"]:
        """Between the poses before and after, in the heading frame."""
        a, b = max(self._frame - 1, 0), min(self._frame + 1, len(self._poses) - 1)
        if a == b:
            return np.zeros(3)
        yaw = yaw_of(np, self._poses[[a, b], 3:7])
        step, span = self._poses[b, :2] - self._poses[a, :2], (b - a) * POSE_DT
        c, s = np.cos(yaw[0]), np.sin(yaw[0])
        return np.array([c * step[0] + s * step[1], -s * step[0] + c * step[1], wrap_angle(yaw[1] - yaw[0])]) / span
