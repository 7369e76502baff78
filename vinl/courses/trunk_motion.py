"""How a locomotor carries its trunk and executes velocities: roll-outs under commands like a navigator's."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from vinl.chain.choose import check_locomotion_policy
from vinl.chain.controller import open_controller
from vinl.chain.robot import Robot, Robots
from vinl.chain.scene import build_scene
from vinl.chain.workers import Context, WorkerPool
from vinl.config.errors import InputError
from vinl.policies.policy import Policy
from vinl.robot.aliengo import CONTROL_DT, DEFAULT_POSE
from vinl.robot.rotation import matrix_of, yaw_of
from vinl.world.boxes import Boxes
from vinl.world.clutter import CLUTTER, scatter_blocks
from vinl.world.endings import MAX_TILT
from vinl.world.floorplan import FloorPlan, assemble_floorplan, frame_around

PERIOD = 25
"""Control steps between two decisions: the navigator's 2 Hz."""

GROUP = 16
"""Robots in one unit of work; they share the clutter and do not see each other."""

_HALF = 20.0
"""Half the side of the walled square that they walk in [m]."""

_MODES = ((0.55, (0.6, 1.0), (0.0, 0.25)), (0.25, (0.3, 0.8), (0.2, 1.05)), (0.15, (0.0, 0.15), (0.5, 1.05)))
"""What a navigator asks for: share, forward speed [m/s] and size of the yaw rate [rad/s] of walking on, of walking a
curve and of turning on the spot; the rest of the time it stands."""

_STAY, _JITTER = 0.8, (0.08, 0.15)
"""Share of the decisions that keep to the mode before, and what is added to each decision [m/s, rad/s]."""


@dataclass(frozen=True, eq=False)
class MotionRecord:
    """One robot, decision by decision, up to its fall if it fell.

    Attributes:
        poses: (k, 3) x, y [m], yaw [rad] when the decision is made.
        tilts: (k, 3) roll, pitch (nose down is positive) [rad] and height [m] of the trunk at that time.
        commands: (k, 2) forward speed [m/s] and yaw rate [rad/s] from then on.
        fell: whether it fell.
    """

    poses: Float[np.ndarray, "k 3"]
    tilts: Float[np.ndarray, "k 3"]
    commands: Float[np.ndarray, "k 2"]
    fell: bool


def record_motion(
    policy: Policy, clutter: str = "none", robots: int = 64, seconds: float = 30.0, seed: int = 0, workers: int = 1
) -> list[MotionRecord]:
    """Let robots walk in MuJoCo C under random commands at 2 Hz.

    Args:
        policy: the locomotor.
        clutter: preset of the blocks on the level ground.
        robots: how many.
        seconds: how long each walks [s].
        seed: of commands, starts and clutter.
        workers: processes; the records do not depend on it.

    Raises:
        InputError: an unknown preset, a number out of range, or a policy that is no locomotor.
    """
    check_locomotion_policy(policy)
    if clutter not in CLUTTER:
        raise InputError(f"clutter {clutter!r} is not a preset; known: {', '.join(CLUTTER)}")
    if robots < 1 or not 2 <= seconds <= 3600:
        raise InputError(f"at least one robot and 2 to 3600 s, got {robots} and {seconds:g}")
    jobs = [range(first, min(first + GROUP, robots)) for first in range(0, robots, GROUP)]
    with WorkerPool(min(workers, len(jobs)), (policy, clutter, round(seconds / CONTROL_DT), seed)) as pool:
        return [record for group in pool.run(_record_group, jobs, lambda: None) for record in group]


def draw_commands(rng: np.random.Generator, count: int) -> Float[np.ndarray, "count 2"]:
    """Forward speeds [m/s] and yaw rates [rad/s] as a navigator gives them, one each 0.5 s."""
    commands, aim = np.zeros((count, 2)), np.zeros(2)
    for k in range(count):
        if k == 0 or rng.random() > _STAY:
            aim = np.zeros(2)
            at = rng.random()
            for share, speed, rate in _MODES:
                if 0 <= at < share:
                    aim = np.array([rng.uniform(*speed), rng.uniform(*rate) * rng.choice([-1.0, 1.0])])
                at -= share
        commands[k] = aim + rng.normal(size=2) * _JITTER if aim.any() else aim
    return np.clip(commands, [0.0, -np.pi / 3], [1.0, np.pi / 3])


def _build_square() -> FloorPlan:
    side, thick = 2 * _HALF, 0.1
    walls = [[x, 0.0, 0.0, thick, side, 0.0, 2.5] for x in (-_HALF, _HALF)]
    walls += [[0.0, y, 0.0, side, thick, 0.0, 2.5] for y in (-_HALF, _HALF)]
    frame = frame_around(np.full(2, -_HALF), np.full(2, _HALF), "square")
    x, y = frame.centres()
    inside = np.outer(np.abs(y) < _HALF, np.abs(x) < _HALF)
    return assemble_floorplan("square", "square", Boxes(np.array(walls)), Boxes.empty(), inside, frame)


def _record_group(context: Context, robots: range) -> list[MotionRecord]:
    policy, clutter, steps, seed = context.shared
    n, plan = len(robots), _build_square()
    rngs = [np.random.Generator(np.random.Philox(np.random.SeedSequence([seed, k]))) for k in robots]
    orders = np.stack([draw_commands(rng, steps // PERIOD + 1) for rng in rngs])
    starts = np.stack([np.append(rng.uniform(-6, 6, 2), rng.uniform(-np.pi, np.pi)) for rng in rngs])
    scatter = np.random.Generator(np.random.Philox(np.random.SeedSequence([seed, robots.start, 1])))
    blocks = scatter_blocks(plan, CLUTTER[clutter], scatter, starts[:, :2])
    kp, kd = (float(policy.card.action[key]) for key in ("kp", "kd"))
    model = build_scene(plan.boxes, blocks.boxes(), kp=kp, kd=kd)
    each = [Robot(model) for _ in robots]
    for body, (x, y, yaw), rng in zip(each, starts, rngs, strict=True):
        body.spawn(float(x), float(y), float(yaw), DEFAULT_POSE + rng.uniform(-0.05, 0.05, 12))
    controller = open_controller(policy, plan, [blocks] * n)
    controller.reset(n)
    bodies, command = Robots(each), np.zeros((n, 3))
    qpos, qvel = bodies.qpos, bodies.qvel
    history, length, fell = [], np.full(n, steps // PERIOD), np.zeros(n, bool)
    alive = list(range(n))
    for step in range(steps):
        if step % PERIOD == 0:
            if context.is_stopped():
                break
            k = step // PERIOD
            history.append(_read_trunk(qpos))
            command[:, 0], command[:, 2] = orders[:, k].T
        bodies.step(controller.step(qpos, qvel, command, alive), alive)
        for k in list(alive):
            out = np.abs(qpos[k, :2]).max() > _HALF - 1.5
            if out or bodies[k].has_fallen(MAX_TILT):
                fell[k] = not out
                length[k] = max(step // PERIOD - (0 if out else 2), 0)  # the tumble is no walking
                alive.remove(k)
    read = np.stack(history, 1)
    return [MotionRecord(read[k, :m, :3], read[k, :m, 3:], orders[k, :m], bool(fell[k])) for k, m in enumerate(length)]


def _read_trunk(qpos: Float[np.ndarray, "n 19"]) -> Float[np.ndarray, "n 6"]:
    """x, y, yaw, roll, pitch and height of every trunk; turned by roll, then pitch, then yaw."""
    turn = matrix_of(np, qpos[:, 3:7])
    pitch = np.arcsin(np.clip(-turn[:, 2, 0], -1, 1))
    roll = np.arctan2(turn[:, 2, 1], turn[:, 2, 2])
    return np.column_stack([qpos[:, :2], yaw_of(np, qpos[:, 3:7]), roll, pitch, qpos[:, 2]])
