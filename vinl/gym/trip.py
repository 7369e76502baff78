"""One episode of the chain, one control step at a time, decided from outside."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from jaxtyping import Float, UInt8

from vinl.chain.batching import batch_navigator, batch_policy
from vinl.chain.choose import load_navigator
from vinl.chain.config import EvaluationConfig
from vinl.chain.controller import open_controller
from vinl.chain.depth_cameras import DepthCameras, open_depth_cameras
from vinl.chain.episode import EpisodeSetup, Recorder
from vinl.chain.metrics import tracking_errors
from vinl.chain.navigators.base import Navigator, Task, decide, goal_in_heading_frame
from vinl.chain.records import Episode
from vinl.chain.robot import KINDS, KINDS_OF, Robot
from vinl.chain.scene import build_scene
from vinl.policies.policy import Policy
from vinl.render.raytrace import ChaseCamera, RayRenderer
from vinl.render.scene import RobotShape, plan_scene
from vinl.robot.aliengo import CONTROL_DT, KD, KP
from vinl.robot.rotation import yaw_of
from vinl.world.free_space import FreeSpace, distance_field, read_field

_WALLS = {k for k, kind in enumerate(KINDS) if kind.endswith("_wall")}


class Trip:
    """The robot of an episode on its way, counted as ``evaluate`` counts it.

    Args:
        kp: position gain of the joints [N m / rad].
        kd: velocity gain of the joints [N m s / rad].

    Attributes:
        task: free floor and route, what an oracle may know.
        steps: control steps of 0.02 s made.
        foot_steps: those in which a foot was on a block, a wall or furniture.
        touched_wall: whether the last control step touched a wall or furniture with any part.
        geodesic_m: shortest path to the goal [m]; where none is known, the last one that was.
        end: why the episode ended, one of ``records.END_REASONS``; empty while it goes on.
    """

    def __init__(
        self, space: FreeSpace, setup: EpisodeSetup, rules: EvaluationConfig, kp: float = KP, kd: float = KD
    ) -> None:
        self.task, self.setup, self._rules = Task(space, setup.route), setup, rules
        self.robot = Robot(build_scene(space.plan.boxes, setup.blocks.boxes(), kp=kp, kd=kd))
        self.robot.spawn(float(setup.route.start[0]), float(setup.route.start[1]), setup.yaw, setup.joints)
        self._recorder = Recorder(setup, space, rules, film=False)
        self._field = distance_field(space.traversable, space.plan.frame, setup.route.goal)
        self._limit = round(rules.time_limit / CONTROL_DT)
        self.steps, self.foot_steps, self.touched_wall, self.end = 0, 0, False, ""
        self.geodesic_m = setup.route.geodesic_m
        self.measure_way()

    @property
    def qpos(self) -> Float[np.ndarray, "1 19"]:
        """Generalised position, as a batch of one; a copy."""
        return self.robot.qpos[None].copy()

    @property
    def qvel(self) -> Float[np.ndarray, "1 18"]:
        """Generalised velocity, as a batch of one; a copy."""
        return self.robot.qvel[None].copy()

    @property
    def pose(self) -> Float[np.ndarray, "1 3"]:
        """x, y [m] and yaw [rad]."""
        qpos = self.qpos
        return np.column_stack([qpos[:, :2], yaw_of(np, qpos[:, 3:7])])

    @property
    def goal(self) -> Float[np.ndarray, "1 3"]:
        """Straight distance to the goal [m], cosine and sine of its bearing in the heading frame, left positive."""
        return goal_in_heading_frame(self.pose, self.setup.route.goal[None])

    def measure_way(self) -> float:
        """How much nearer the goal has come on foot since the last call [m]; updates ``geodesic_m``."""
        now = float(read_field(self._field, self.task.space.plan.frame, self.robot.qpos[:2]))
        before, self.geodesic_m = self.geodesic_m, now if np.isfinite(now) else self.geodesic_m
        return before - self.geodesic_m

    def advance(self, target: Float[np.ndarray, "12"], command: Float[np.ndarray, "1 3"]) -> None:
        """One control step towards joint targets [rad].

        Args:
            command: velocities that the robot was to have, for the errors in the record.
        """
        self._recorder.note_pose(self.steps, self.robot.qpos, command[0])
        self.robot.step(target)
        self.steps += 1
        self._recorder.count(self.steps, self.robot, tracking_errors(self.qpos, self.qvel, command)[0])
        touched = self.robot.contacts.touches.keys()
        self.foot_steps += not touched.isdisjoint(KINDS_OF["foot"])
        self.touched_wall = bool(_WALLS & touched)
        if np.linalg.norm(self.robot.qpos[:2] - self.setup.route.goal) < self._rules.success_radius:
            self._end("success")
        elif self.robot.has_fallen(self._rules.max_tilt):
            self._end("fall")
        elif self.steps == self._limit:
            self._recorder.end_of_time()
            self._end(self.close().record.end_reason)

    def close(self) -> Episode:
        """Record and trace of the episode."""
        return self._recorder.close()

    def _end(self, reason: str) -> None:
        self.end = reason
        self._recorder.end(reason)


SIZE = (640, 480)
"""Width and height [pixels]."""

_FILM_DT = 0.08
"""The camera's smoothing is tuned to pictures so far apart [s]."""


class ChaseView:
    """The robot of an episode from behind and above.

    Args:
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


class Legs:
    """A locomotor that carries out velocities.

    Attributes:
        gains: kp [N m / rad] and kd [N m s / rad] that it was trained with.
    """

    def __init__(self, policy: Policy) -> None:
        self._policy = batch_policy(policy)
        self.gains = float(policy.card.action["kp"]), float(policy.card.action["kd"])

    def enter(self, trip: Trip, ceiling: float | None) -> None:
        """A new episode begins."""
        self._controller = open_controller(self._policy, trip.task.space.plan, [trip.setup.blocks], ceiling)
        self._controller.reset(1)

    def choose(self, trip: Trip, command: Float[np.ndarray, "1 3"]) -> Float[np.ndarray, "12"]:
        """Joint targets [rad] of the next control step."""
        return self._controller.step(trip.qpos, trip.qvel, command, [0])[0]


class Guide:
    """A navigator that chooses the velocities, see ``Navigator``."""

    def __init__(self, navigator: str | Path | Navigator, rules: EvaluationConfig) -> None:
        by_name = isinstance(navigator, (str, Path))
        self._navigator = batch_navigator(load_navigator(navigator, rules) if by_name else navigator)
        self._cameras: DepthCameras | None = None

    def enter(self, trip: Trip, ceiling: float | None) -> None:
        """A new episode begins."""
        self._navigator.reset([trip.task])
        self._last = np.zeros((1, 2))
        camera = self._navigator.camera
        plan, blocks = trip.task.space.plan, [trip.setup.blocks]
        self._cameras = None if camera is None else open_depth_cameras(plan, blocks, camera, ceiling)

    def choose(self, trip: Trip) -> Float[np.ndarray, "2"]:
        """Forward speed [m/s] and yaw rate [rad/s] of the next half second."""
        depth = None if self._cameras is None else self._cameras.look(trip.qpos, [0])
        self._last = decide(self._navigator, trip.setup.route.goal[None], self._last, trip.pose, depth=depth)
        return self._last[0]
