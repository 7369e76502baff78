"""One episode of the chain, one control step at a time, decided from outside."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from vinl.chain.config import EvaluationConfig
from vinl.chain.episode import EpisodeSetup, Recorder
from vinl.chain.metrics import tracking_errors
from vinl.chain.navigators.base import Task, goal_in_heading_frame
from vinl.chain.records import Episode
from vinl.chain.robot import KINDS, Robot
from vinl.chain.scene import build_scene
from vinl.robot.aliengo import CONTROL_DT, KD, KP
from vinl.robot.rotation import yaw_of
from vinl.world.free_space import FreeSpace, distance_field, read_field

_WALLS = {k for k, kind in enumerate(KINDS) if kind.endswith("_wall")}
_FEET = {k for k, kind in enumerate(KINDS) if kind.startswith("foot_")}


class Trip:
    """The robot of an episode on its way, counted as ``evaluate`` counts it.

    Args:
        space: the free floor of the plan.
        setup: start, goal and clutter.
        rules: limits of the episode.
        kp: position gain of the joints [N m / rad].
        kd: velocity gain of the joints [N m s / rad].

    Attributes:
        task: free floor and route, what an oracle may know.
        setup: start, goal and clutter.
        robot: the robot.
        steps: control steps of 0.02 s made.
        foot_steps: those in which a foot was on a block, a wall or furniture.
        touched_wall: whether the last control step touched a wall or furniture with any part.
        geodesic_m: shortest way to the goal [m]; where none is known, the last one that was.
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
            target: of the joints.
            command: velocities that the robot was to have, for the errors in the record.
        """
        self._recorder.note_pose(self.steps, self.robot.qpos, command[0])
        self.robot.step(target)
        self.steps += 1
        self._recorder.count(self.steps, self.robot, tracking_errors(self.qpos, self.qvel, command)[0])
        touched = self.robot.contacts.touches.keys()
        self.foot_steps += bool(_FEET & touched)
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
