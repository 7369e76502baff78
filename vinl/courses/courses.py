"""What every robot of a trial goes through, whatever policy drives it: where it starts and what it is told, when."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from vinl.config.errors import InputError
from vinl.config.loader import closest
from vinl.courses.grounds import Ground
from vinl.policies.policy import Policy
from vinl.robot.aliengo import CONTROL_DT, DEFAULT_POSE, foot_positions, home_qpos
from vinl.robot.commands import UNIFORM, CommandConfig, make_commands

FOOT_CLEARANCE = 0.06
"""In litter, no foot stands with its middle nearer to an object than this [m]."""

START_CLEARANCE = 0.65
"""No robot starts with its trunk nearer than this to the middle of a block [m]: all feet then stand on the floor."""

_COMMAND_LIMIT, _TRIES = 1.0, 1000
_START_STREAM, _COMMAND_STREAM = 0, 1


@dataclass(frozen=True)
class CommandRanges(CommandConfig):
    """Commands of a trial; the time until the next one is rounded to multiples of ``hold_step`` [s]."""

    hold: tuple[float, float] = (5.0, 10.0)
    min_speed: float = 0.0
    stand_share: float = 0.0
    turn_share: float = 0.0
    hold_step: float = CONTROL_DT


_LEVEL, _TURN = (0.0, 0.0), (-np.pi / 3, np.pi / 3)

FIXED = {
    "home": CommandRanges((0.3, 0.8), _LEVEL, (-0.6, 0.6)),
    "steady": CommandRanges((0.4, 0.4), _LEVEL, _LEVEL),
    "turns": CommandRanges((0.3, 1.0), _LEVEL),
    "straight": CommandRanges((0.3, 1.0), _LEVEL, _LEVEL),
    "spin": CommandRanges(_LEVEL, _LEVEL, _TURN),
    "back": CommandRanges((-0.4, -0.2), _LEVEL, (-0.5, 0.5), hold=(1.0, 4.0)),
    "navigator": CommandRanges(
        (0.0, 1.0), _LEVEL, _TURN, hold=(0.5, 4.0), hold_step=0.5, stand_share=0.1, turn_share=0.15
    ),
}
"""Commands that do not depend on the policy, by name. ``home``: how a robot walks through a home; ``navigator``: what a
navigator at 2 Hz asks for."""

DEFAULTS = {"blocks": "home", "litter": "steady", "rooms": "navigator"}
"""The commands on each terrain; ``trained`` on all others."""

COMMANDS = ("trained", "forward", *FIXED)
"""``trained``: what the policies were trained for, at most +-1 m/s and +-1 rad/s; ``forward``: without sideways."""


def choose_commands(name: str | None, terrain: str) -> str:
    """The commands of that name; without one those of ``DEFAULTS``. Raises ``InputError`` if the name is unknown."""
    name = name or DEFAULTS.get(terrain, "trained")
    if name not in COMMANDS:
        raise InputError(f"--commands {name!r} is unknown{closest(name, COMMANDS)}; known: {', '.join(COMMANDS)}")
    return name


def command_ranges(name: str, policies: Sequence[Policy]) -> CommandRanges:
    """The ranges behind a name; for ``trained`` and ``forward`` what all the policies were trained for."""
    if name in FIXED:
        return FIXED[name]
    trained = [policy.card.training.get("commands", {}) for policy in policies]

    def common(key: str) -> tuple[float, float]:
        ranges = [t.get(key, (-_COMMAND_LIMIT, _COMMAND_LIMIT)) for t in trained]
        low = max(-_COMMAND_LIMIT, *(float(r[0]) for r in ranges))
        high = min(_COMMAND_LIMIT, *(float(r[1]) for r in ranges))
        if low > high:
            raise InputError(f"the policies have no {key} command in common; give --commands home or navigator")
        return low, high

    left = _LEVEL if name == "forward" else common("left")
    slowest = max(float(t.get("min_speed", 0.2)) for t in trained)
    return CommandRanges(common("forward"), left, common("yaw_rate"), min_speed=slowest)


@dataclass(frozen=True, eq=False)
class Start:
    """A robot at rest: x, y [m] and heading [rad] of its trunk, joint angles [rad], height of the ground there [m]."""

    x: float
    y: float
    yaw: float
    joints: Float[np.ndarray, "12"]
    ground: float


class Course:
    """The way of one robot over so many control steps, from the home of a number. Commands (forward, left [m/s], yaw
    rate [rad/s] at each step; ``fresh`` where a new one begins) follow the clock, so that a fall changes nothing of
    what comes later."""

    def __init__(self, ground: Ground, ranges: CommandRanges, seed: int, robot: int, steps: int) -> None:
        self.robot, self.home = robot, robot % len(ground.homes)
        self._ground, self._rng = ground, _stream(seed, robot, _START_STREAM)
        self.commands, self.fresh = draw_commands(ranges, _stream(seed, robot, _COMMAND_STREAM), steps)

    def draw_start(self) -> Start:
        """The next start: the first of the trial, then one after every fall and at the end of the ground."""
        ground, rng = self._ground, self._rng
        home, widest = ground.homes[self.home], -np.inf
        x = y = yaw = 0.0
        for _ in range(_TRIES):
            xy = home[:2] + rng.uniform(-ground.spread, ground.spread, 2)
            tried = float(rng.uniform(-np.pi, np.pi)) if ground.among else 0.0
            gap = self._measure_gap(xy, tried)
            if gap > widest:
                widest, (x, y), yaw = gap, xy.tolist(), tried
            if gap > (FOOT_CLEARANCE if ground.among else START_CLEARANCE):
                break
        joints = DEFAULT_POSE + rng.uniform(-0.05, 0.05, 12)
        return Start(x, y, yaw if ground.among else float(rng.uniform(-np.pi, np.pi)), joints, float(home[2]))

    def _measure_gap(self, xy: Float[np.ndarray, "2"], yaw: float) -> float:
        """From the robot to the nearest block: from its feet among objects, otherwise from its trunk [m]."""
        ground = self._ground
        if ground.among:
            return float(ground.gap(foot_positions(np, home_qpos(*xy, yaw=yaw)[None])[0, :, :2]).min())
        return float(np.linalg.norm(ground.blocks.rows[:, :2] - xy, axis=1).min(initial=np.inf))


def draw_commands(
    ranges: CommandRanges, rng: np.random.Generator, steps: int
) -> tuple[Float[np.ndarray, "steps 3"], np.ndarray]:
    """Commands for so many control steps, and at which of them a new one begins."""
    commands, fresh = np.zeros((steps, 3)), np.zeros(steps, bool)
    step = 0
    while step < steps:
        command, held = make_commands(np, ranges, rng.random(len(UNIFORM)), ranges.hold_step)
        commands[step:], fresh[step] = command, True
        step += int(held)
    return commands, fresh


def _stream(seed: int, robot: int, purpose: int) -> np.random.Generator:
    return np.random.Generator(np.random.Philox(np.random.SeedSequence([seed, robot, purpose])))
