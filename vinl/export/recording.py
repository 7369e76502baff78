"""What a policy was given and what it answered, step by step, while a robot walked in MuJoCo C."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import count
from typing import Any

import numpy as np
import torch

from vinl.chain.choose import load_navigator
from vinl.chain.config import EvaluationConfig
from vinl.chain.episode import draw_routes, draw_setups
from vinl.chain.navigators.base import Navigator
from vinl.chain.navigators.learned import LearnedNavigator
from vinl.chain.records import Episode
from vinl.chain.rollout import InterruptedRunError, run_episodes
from vinl.policies.depth_policy import DepthPolicy
from vinl.policies.io import load_policy
from vinl.policies.policy import LocomotionPolicy, Policy
from vinl.robot.aliengo import CONTROL_DT
from vinl.world.clutter import CLUTTER
from vinl.world.readers import load_floorplan

PLAN, CLUTTERED, ROUTES = "harbour_flat", "paper", 10
"""Where policies are recorded: a shipped floor plan with the paper's clutter, and so many starts and goals in it."""

ROBOTS = {"locomotion": 2, "navigation": 10}
"""Robots that walk side by side: few, for long memories; a navigation policy decides only twice a second."""

WALKER = "blind"
"""The locomotion policy that carries out what a recorded navigation policy asks for: one that needs no images."""


@dataclass
class Sequence:
    """The steps of one robot from the start of its episode.

    Attributes:
        observations: (k,) each, scaled.
        depths: (height, width) each [m]; none if the policy sees none.
        actions: (a,) each.
    """

    observations: list[np.ndarray] = field(default_factory=list)
    depths: list[np.ndarray] = field(default_factory=list)
    actions: list[np.ndarray] = field(default_factory=list)

    def __len__(self) -> int:
        return len(self.actions)


class StepRecorder:
    """A policy that does what another does and writes it down, up to a number of steps.

    Args:
        policy: that is asked.
        steps: to write down, of all robots together.
        on_step: called with how many there are.

    Attributes:
        card, camera: the policy's.
        done: the sequences of all episodes so far.
        ended: rows whose episode is over, which are asked on but no longer written down.
    """

    def __init__(self, policy: LocomotionPolicy | DepthPolicy, steps: int, on_step: Callable[[int], None]) -> None:
        self.card, self.camera = policy.card, policy.camera
        self.done: list[Sequence] = []
        self.ended: set[int] = set()
        self._policy, self._left, self._steps, self._on_step = policy, steps, steps, on_step
        self._rows: list[Sequence] = []

    @property
    def is_full(self) -> bool:
        """Whether all steps were written down."""
        return self._left == 0

    def reset(self, which: Any) -> None:
        """See ``Policy.reset``; so many episodes begin."""
        self._policy.reset(which)
        self._rows = [Sequence() for _ in range(int(which))]
        self.done += self._rows
        self.ended = set()

    def act(self, observation: Any, depth: Any = None) -> Any:
        """See ``Policy.act``."""
        answer = self._policy.act(observation, depth)
        for row, sequence in enumerate(self._rows):
            if row in self.ended or self.is_full:
                continue
            sequence.observations.append(np.array(observation[row], np.float32))
            if depth is not None:
                sequence.depths.append(np.asarray(torch.as_tensor(depth[row])).astype(np.float32))
            sequence.actions.append(np.array(answer[row], np.float32))
            self._left -= 1
        self._on_step(self._steps - self._left)
        return answer


def record_steps(
    policy: LocomotionPolicy | DepthPolicy, steps: int, on_step: Callable[[int], None] = lambda _: None
) -> list[Sequence]:
    """Walk through a shipped home, through clutter, until a policy was asked so often.

    A locomotion policy is driven by the navigator that knows the floor plan, a navigation policy drives ``WALKER``.

    Args:
        policy: of either kind.
        steps: of all episodes together.
        on_step: called with the steps so far.
    """
    recorder, config = StepRecorder(policy, steps, on_step), EvaluationConfig()
    locomotion: Policy = recorder
    navigator: Navigator
    if policy.card.kind == "navigation":
        locomotion = load_policy(WALKER)
        navigator = LearnedNavigator(recorder, config.navigation_period * CONTROL_DT)
    else:
        navigator = load_navigator("oracle", config)
    plan, robots = load_floorplan(PLAN), ROBOTS[policy.card.kind]
    routes = draw_routes(plan, ROUTES, config)
    for seed in count():
        setups = draw_setups(plan, routes, seed, CLUTTER[CLUTTERED], config)
        for first in range(0, ROUTES, robots):
            some = setups[first : first + robots]
            rows = {(setup.plan, setup.seed, setup.episode): row for row, setup in enumerate(some)}

            def note_end(episode: Episode, rows: dict[Any, int] = rows) -> None:
                recorder.ended.add(rows[episode.record.key])

            try:
                run_episodes(
                    *(plan, some, locomotion, navigator, config),
                    on_end=note_end,
                    is_stopped=lambda: recorder.is_full,
                )
            except InterruptedRunError:
                return [sequence for sequence in recorder.done if len(sequence)]
            if recorder.is_full:
                return [sequence for sequence in recorder.done if len(sequence)]
    raise AssertionError("unreachable")
