"""An episode: what is drawn before it starts, the running count of it, and the record that it closes with.

Every random draw follows from (seed, plan name, episode), on every machine alike."""

from __future__ import annotations

import zlib
from dataclasses import dataclass, fields

import numpy as np
from jaxtyping import Float

from vinl.chain.config import EvaluationConfig
from vinl.chain.metrics import FALL_WINDOW, find_cause, soft_spl, spl
from vinl.chain.records import Episode, EpisodeRecord, EpisodeTrace
from vinl.chain.robot import Robot
from vinl.robot.aliengo import CONTROL_DT, DEFAULT_POSE
from vinl.world.boxes import Blocks
from vinl.world.clutter import ClutterPreset, scatter_blocks
from vinl.world.endings import FALL, STUCK, SUCCESS, name_late_end
from vinl.world.floorplan import FloorPlan
from vinl.world.free_space import FreeSpace
from vinl.world.start_goal import StartGoal, sample_start_goals, shortest_distance

_START_GOALS, _CLUTTER, _START, _SENSORS, _FAULTS = range(5)


def make_rng(purpose: int, plan: str, *numbers: int) -> np.random.Generator:
    """A generator of its own for each purpose, plan and (seed, episode): no draw depends on what ran before."""
    return np.random.Generator(np.random.Philox(np.random.SeedSequence([purpose, zlib.crc32(plan.encode()), *numbers])))


@dataclass(frozen=True, eq=False)
class EpisodeSetup:
    """What is decided before an episode starts.

    Attributes:
        plan: name of the floor plan.
        episode: number of the start/goal pair in the plan.
        yaw: heading at the start [rad].
        joints: (12,) joint angles at the start [rad].
    """

    plan: str
    episode: int
    seed: int
    route: StartGoal
    yaw: float
    joints: Float[np.ndarray, "12"]
    blocks: Blocks


def draw_routes(plan: FloorPlan, count: int, config: EvaluationConfig) -> list[StartGoal]:
    """The start/goal pairs of a plan: as in the paper, the same for every seed."""
    return sample_start_goals(plan, count, make_rng(_START_GOALS, plan.name), config.min_distance, config.clearance)


def draw_setup(
    plan: FloorPlan, route: StartGoal, episode: int, seed: int, clutter: ClutterPreset, config: EvaluationConfig
) -> EpisodeSetup:
    """One repetition of one pair: the seed changes clutter, heading and joint angles at the start."""
    rng = make_rng(_START, plan.name, seed, episode)
    yaw = float(rng.uniform(-np.pi, np.pi))
    joints = DEFAULT_POSE + rng.uniform(-config.joint_noise, config.joint_noise, 12)
    ends = np.stack([route.start, route.goal])
    blocks = scatter_blocks(plan, clutter, make_rng(_CLUTTER, plan.name, seed, episode), ends)
    return EpisodeSetup(plan.name, episode, seed, route, yaw, joints, blocks)


def sensor_key(setup: EpisodeSetup) -> int:
    """The number below 2^31 that the errors of an episode's cameras and odometry follow from."""
    return int(make_rng(_SENSORS, setup.plan, setup.seed, setup.episode).integers(2**31))


def draw_faults(setup: EpisodeSetup) -> np.random.Generator:
    """Where the errors of an episode's measured velocity and attitude come from."""
    return make_rng(_FAULTS, setup.plan, setup.seed, setup.episode)


def draw_setups(
    plan: FloorPlan, routes: list[StartGoal], seed: int, clutter: ClutterPreset, config: EvaluationConfig
) -> list[EpisodeSetup]:
    """One repetition of all pairs."""
    return [draw_setup(plan, route, k, seed, clutter, config) for k, route in enumerate(routes)]


PATH_EVERY, FILM_EVERY = 5, 2
"""Control steps between two points of the path (0.1 s) and between two poses for a video (0.04 s)."""

_FOOT, _LEG, _TRUNK = (0, 1), (2, 3), (4, 5)

_COUNTED = tuple(f.name for f in fields(EpisodeRecord) if f.name.endswith("_steps"))


class Recorder:
    """Counts one episode, step by step."""

    def __init__(self, setup: EpisodeSetup, space: FreeSpace, config: EvaluationConfig, film: bool) -> None:
        self._setup, self._space, self._config, self._film = setup, space, config, film
        self._at = setup.route.start.astype(np.float64)
        self._path: list[np.ndarray] = [self._at.copy()]
        self._contacts: list[tuple[float, int, float, float]] = []
        self._poses: list[np.ndarray] = []
        self._commands: list[np.ndarray] = []
        self._counts = dict.fromkeys(_COUNTED, 0)
        self._errors = np.zeros(2)
        self._steps, self._distance, self._end = 0, 0.0, ""

    def note_pose(self, step: int, qpos: Float[np.ndarray, "19"], command: Float[np.ndarray, "3"]) -> None:
        """Keep what a video shows, before control step ``step``."""
        if self._film and step % FILM_EVERY == 0:
            self._poses.append(qpos.copy())
            self._commands.append(command.copy())

    def count(self, steps: int, robot: Robot, errors: Float[np.ndarray, "2"]) -> None:
        """Add what the control step brought; ``steps`` have been made by now."""
        x, y = float(robot.qpos[0]), float(robot.qpos[1])
        self._distance += float(np.hypot(x - self._at[0], y - self._at[1]))
        self._at[:] = x, y
        self._errors += errors
        self._steps = steps
        if steps % PATH_EVERY == 0:
            self._path.append(self._at.copy())
        touches, counts = robot.contacts.touches, self._counts
        counts["paper_foot_steps"] += robot.contacts.breaks_paper_rule()
        if touches:
            counts["foot_steps"] += any(kind in touches for kind in _FOOT)
            counts["foot_block_steps"] += _FOOT[0] in touches
            counts["foot_wall_steps"] += _FOOT[1] in touches
            counts["leg_contact_steps"] += any(kind in touches for kind in _LEG)
            counts["trunk_contact_steps"] += any(kind in touches for kind in _TRUNK)
            time = steps * CONTROL_DT
            self._contacts += [(time, touch.kind, touch.x, touch.y) for touch in touches.values()]

    def end(self, reason: str) -> None:
        """The episode is over."""
        self._end = reason

    def end_of_time(self) -> None:
        """The episode is over: it ran out of time."""
        back = int(self._config.stuck_window / (PATH_EVERY * CONTROL_DT))
        long_enough = len(self._path) > back
        moved = np.linalg.norm(self._at - self._path[-1 - back]) if long_enough else np.inf
        stuck = bool(moved < self._config.stuck_distance)
        self.end(name_late_end(stuck, self._distance, self._setup.route.geodesic_m))

    def close(self) -> Episode:
        """Record and trace of the episode."""
        setup, route = self._setup, self._setup.route
        success, rmse = self._end == SUCCESS, np.sqrt(self._errors / max(self._steps, 1))
        left = 0.0 if success else self._left()
        contacts = np.array(self._contacts, np.float64).reshape(-1, 4)
        record = EpisodeRecord(
            plan=setup.plan,
            episode=setup.episode,
            seed=setup.seed,
            start=(float(route.start[0]), float(route.start[1])),
            goal=(float(route.goal[0]), float(route.goal[1])),
            yaw=setup.yaw,
            straight_m=route.straight_m,
            geodesic_m=route.geodesic_m,
            blocks=len(setup.blocks),
            success=success,
            end_reason=self._end,
            fell=self._end == FALL,
            time_s=self._steps * CONTROL_DT,
            distance_m=self._distance,
            spl=spl(success, route.geodesic_m, self._distance),
            soft_spl=soft_spl(route.geodesic_m, left, self._distance),
            **self._counts,
            speed_rmse=float(rmse[0]),
            yaw_rate_rmse=float(rmse[1]),
            end_at=self._find_cause(contacts),
            note=route.note,
        )
        trace = EpisodeTrace(
            path=np.round(np.array([*self._path, self._at]), 3),
            contacts=np.round(contacts, 3),
            blocks=setup.blocks.rows,
            poses=np.array(self._poses, np.float64).reshape(-1, 19),
            commands=np.array(self._commands, np.float64).reshape(-1, 3),
        )
        return Episode(record, trace)

    def _find_cause(self, contacts: Float[np.ndarray, "m 4"]) -> str:
        """What a robot fell over, or was stuck at."""
        window = {FALL: FALL_WINDOW, STUCK: self._config.stuck_window}.get(self._end)
        if window is None:
            return ""
        since = self._steps * CONTROL_DT - window
        return find_cause(self._at, contacts, since, self._space, self._setup.blocks)

    def _left(self) -> float:
        """Shortest distance to the goal from where the episode ended [m]; zero would be a success."""
        return shortest_distance(self._space, self._at, self._setup.route.goal)
