"""Which episodes are run: every random draw follows from (seed, plan name, episode), on every machine alike."""

from __future__ import annotations

import zlib
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from vinl.chain.config import EvaluationConfig
from vinl.robot.aliengo import DEFAULT_POSE
from vinl.world.boxes import Blocks
from vinl.world.clutter import ClutterPreset, scatter_blocks
from vinl.world.floorplan import FloorPlan
from vinl.world.start_goal import StartGoal, sample_start_goals

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
        seed: which repetition.
        route: start, goal and distances.
        yaw: heading at the start [rad].
        joints: (12,) joint angles at the start [rad].
        blocks: the clutter of this episode.
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
