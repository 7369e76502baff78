"""Pictures of an episode under way, by the project's own ray renderer."""

from __future__ import annotations

import numpy as np
from jaxtyping import UInt8

from vinl.gym.trip import Trip
from vinl.render.chase_camera import ChaseCamera
from vinl.render.raytrace import RayRenderer
from vinl.render.robot_shape import RobotShape
from vinl.render.scene import plan_scene

SIZE = (640, 480)
"""Width and height [pixels]."""

_FILM_DT = 0.08
"""The camera's smoothing is tuned to pictures so far apart [s]."""


class ChaseView:
    """The robot of an episode from behind and above.

    Args:
        trip: the episode.
        period: time between two pictures [s].
    """

    def __init__(self, trip: Trip, period: float) -> None:
        goal = trip.setup.route.goal
        self._shape = RobotShape()
        scene = plan_scene(trip.task.space.plan, trip.setup.blocks, goal=(float(goal[0]), float(goal[1])))
        self._renderer = RayRenderer(scene, self._shape.bodies, self._shape.names)
        self._camera = ChaseCamera(self._renderer, smoothing=1.0 - 0.92 ** (period / _FILM_DT))

    def draw(self, trip: Trip) -> UInt8[np.ndarray, "height width 3"]:
        """The picture of this moment."""
        qpos, pose = trip.qpos[0], trip.pose[0]
        return self._renderer.render(self._camera.follow(qpos[:3], float(pose[2])), *SIZE, *self._shape.place(qpos))
