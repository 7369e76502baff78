"""The chained roll-out: the navigator at 2 Hz, the locomotor at 50 Hz, physics at 200 Hz in MuJoCo C."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence

import numpy as np

from vinl.chain.batching import ask_only, batch_navigator, batch_policy
from vinl.chain.config import EvaluationConfig, FaultConfig
from vinl.chain.controller import open_controller
from vinl.chain.depth_cameras import CameraErrors, open_depth_cameras
from vinl.chain.episode import EpisodeSetup, Recorder, draw_faults, sensor_key
from vinl.chain.metrics import tracking_errors
from vinl.chain.navigators.base import Navigator, Task, decide
from vinl.chain.navigators.learned import DeadReckoning
from vinl.chain.records import Episode
from vinl.chain.robot import FaultyState, Robot, Robots, build_model
from vinl.policies.policy import Policy
from vinl.robot.aliengo import CONTROL_DT
from vinl.robot.rotation import yaw_of
from vinl.world.floorplan import FloorPlan
from vinl.world.free_space import FreeSpace


class InterruptedRunError(Exception):
    """The roll-out was asked to stop."""


def run_episodes(
    plan: FloorPlan,
    setups: Sequence[EpisodeSetup],
    locomotor: Policy,
    navigator: Navigator,
    config: EvaluationConfig,
    filmed: Collection[int] = (),
    on_end: Callable[[Episode], None] = lambda _: None,
    is_stopped: Callable[[], bool] = lambda: False,
) -> list[Episode]:
    """Run episodes of one plan in lockstep.

    An episode gives the same numbers whichever others it is run with: shipped kinds of policies are asked in calls of
    sizes that give the same bits, for those that still live (``batches``). Policies and navigators of one's own are
    always asked for all rows, those of finished episodes too; they are then the same as long as they are run with the
    same others. Images are rendered for the living alone; the others keep their last one.

    Args:
        locomotor: see ``LocomotionController``.
        navigator: see ``Navigator``.
        filmed: rows whose poses are kept.
        on_end: called with each episode that ended, in the order in which they end.
        is_stopped: asked before each decision of the navigator.

    Raises:
        InterruptedRunError: ``is_stopped`` said so.
        InputError: a policy answered what is no answer.
    """
    n, space = len(setups), FreeSpace(plan)
    locomotor, navigator = batch_policy(locomotor), batch_navigator(navigator)
    navigator.reset([Task(space, setup.route) for setup in setups])
    robots = Robots(_spawn_robots(plan, setups, locomotor, config.faults))
    faults = config.faults
    blocks = [setup.blocks for setup in setups]
    keys = [sensor_key(setup) for setup in setups]
    sensors = None if config.sensors.is_ideal else CameraErrors(config.sensors, keys)
    state = FaultyState(faults, [draw_faults(setup) for setup in setups]) if faults.spoils_state else None
    controller = open_controller(locomotor, plan, blocks, config.ceiling, sensors)
    cameras = None
    if navigator.camera is not None:
        cameras = open_depth_cameras(plan, blocks, navigator.camera, config.ceiling)
    if cameras is not None and sensors is not None:
        cameras = sensors.put_on(cameras)
    reckoning = None if config.odometry.is_exact else DeadReckoning(config.odometry, keys)
    goals = np.stack([setup.route.goal for setup in setups])
    recorders = [Recorder(setup, space, config, film=k in filmed) for k, setup in enumerate(setups)]
    command, choice = np.zeros((n, 3)), np.zeros((n, 2))
    controller.reset(n)
    alive, done = list(range(n)), dict[int, Episode]()
    ask_only(alive, locomotor, navigator)
    qpos, qvel = robots.qpos, robots.qvel
    limit = round(config.time_limit / CONTROL_DT)
    for step in range(limit):
        if sensors is not None:
            sensors.note(qpos)
        known = (qpos, qvel) if state is None else state.measure(qpos, qvel, alive)
        if step % config.navigation_period == 0:
            if is_stopped():
                raise InterruptedRunError
            pose = np.column_stack([qpos[:, :2], yaw_of(np, qpos[:, 3:7])])
            believed = pose if reckoning is None else reckoning.follow(pose)
            depth = None if cameras is None else cameras.look(qpos, alive)
            choice = decide(navigator, goals, choice, pose, believed, depth)
            command[:, 0], command[:, 2] = choice[:, 0], choice[:, 1]
        for k in alive:
            recorders[k].note_pose(step, qpos[k], command[k])
        robots.step(controller.step(*known, command, alive), alive)
        errors = tracking_errors(qpos, qvel, command)
        away = np.linalg.norm(qpos[:, :2] - goals, axis=1)
        for k in list(alive):
            recorders[k].count(step + 1, robots[k], errors[k])
            if away[k] < config.success_radius:
                recorders[k].end("success")
            elif robots[k].has_fallen(config.max_tilt):
                recorders[k].end("fall")
            elif step + 1 == limit:
                recorders[k].end_of_time()
            else:
                continue
            alive.remove(k)
            done[k] = recorders[k].close()
            on_end(done[k])
        if not alive:
            break
    return [done[k] for k in range(n)]


def _spawn_robots(
    plan: FloorPlan, setups: Sequence[EpisodeSetup], locomotor: Policy, faults: FaultConfig
) -> list[Robot]:
    robots, bare = [], None  # those without blocks share a model
    for setup in setups:
        cluttered = len(setup.blocks) > 0
        model = None if cluttered else bare
        if model is None:
            model = build_model(plan.boxes, setup.blocks.boxes(), locomotor.card, faults)
        bare = bare if cluttered else model
        robots.append(Robot(model, faults.delay_steps))
        robots[-1].spawn(float(setup.route.start[0]), float(setup.route.start[1]), setup.yaw, setup.joints)
    return robots
