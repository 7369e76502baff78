"""Whether an exported file answers as the policy did: what a policy was given and what it answered while a robot walked
in MuJoCo C, and the file asked the same."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import count
from pathlib import Path
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
from vinl.export.metadata import read_metadata
from vinl.export.step import AGE, DEPTH, OBSERVATION
from vinl.policies.depth_policy import DepthPolicy
from vinl.policies.io import load_policy
from vinl.policies.policy import LocomotionPolicy, Policy
from vinl.robot.aliengo import CONTROL_DT
from vinl.sensing.sensor_config import SensorConfig
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
    """The steps of one robot from the start of its episode: scaled observations (k,), depths (height, width) [m] and
    their ages [s], none if the policy sees or dates none, and actions (a,)."""

    observations: list[np.ndarray] = field(default_factory=list)
    depths: list[np.ndarray] = field(default_factory=list)
    ages: list[float] = field(default_factory=list)
    actions: list[np.ndarray] = field(default_factory=list)

    def __len__(self) -> int:
        return len(self.actions)


class StepRecorder:
    """A policy that does what another does and writes down so many steps of all robots together; ``on_step`` is called
    with how many there are. Rows whose episode has ended are asked on but no longer written down."""

    def __init__(self, policy: LocomotionPolicy | DepthPolicy, steps: int, on_step: Callable[[int], None]) -> None:
        self.card, self.camera = policy.card, policy.camera
        self.dates_images = policy.dates_images
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

    def act(self, observation: Any, depth: Any = None, age: Any = None) -> Any:
        """See ``DatesImages.act``."""
        answer = self._policy.act(observation, depth, *([age] if self.dates_images else []))
        for row, sequence in enumerate(self._rows):
            if row in self.ended or self.is_full:
                continue
            sequence.observations.append(np.array(observation[row], np.float32))
            if depth is not None:
                sequence.depths.append(np.asarray(torch.as_tensor(depth[row])).astype(np.float32))
            if age is not None:
                sequence.ages.append(float(age[row]))
            sequence.actions.append(np.array(answer[row], np.float32))
            self._left -= 1
        self._on_step(self._steps - self._left)
        return answer


def record_steps(
    policy: LocomotionPolicy | DepthPolicy, steps: int, on_step: Callable[[int], None] = lambda _: None
) -> list[Sequence]:
    """Walk through a shipped home, through clutter and with late images, until a policy was asked so often in all
    episodes together; ``on_step`` is called with the steps so far.

    A locomotion policy is driven by the navigator that knows the floor plan, a navigation policy drives ``WALKER``.
    """
    recorder, config = StepRecorder(policy, steps, on_step), EvaluationConfig(sensors=SensorConfig(delay=(0.0, 0.06)))
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

            with contextlib.suppress(InterruptedRunError):
                run_episodes(
                    *(plan, some, locomotion, navigator, config), on_end=note_end, is_stopped=lambda: recorder.is_full
                )
            if recorder.is_full:
                return [sequence for sequence in recorder.done if len(sequence)]
    raise AssertionError("unreachable")


LIMIT = 1e-4
"""Actions of file and policy may differ by so much, after any number of steps with memories of their own [1]."""


@dataclass(frozen=True)
class Parity:
    """How the file did: steps that were compared, in how many episodes, in each of which the memory began anew; the
    largest difference between two actions, and the largest action of the policy, to judge it by [1]; the median time of
    a step on one core [ms], the processor's own: others who use it do not count."""

    steps: int
    episodes: int
    worst: float
    largest: float
    step_ms: float

    @property
    def is_kept(self) -> bool:
        """Whether no difference is over the limit; one that is no number is."""
        return self.worst <= LIMIT


class ExportedPolicy:
    """An exported file (its path, or what it holds), run by onnxruntime on one core, with its memory; ``about`` is its
    metadata."""

    def __init__(self, source: str | Path | bytes) -> None:
        import onnxruntime

        options = onnxruntime.SessionOptions()
        options.intra_op_num_threads = options.inter_op_num_threads = 1
        model = source if isinstance(source, bytes) else str(source)
        self._session: Any = onnxruntime.InferenceSession(model, options, providers=["CPUExecutionProvider"])
        self.about = read_metadata(self._session.get_modelmeta().custom_metadata_map)
        self.inputs, self.outputs = (
            {port.name: tuple(port.shape) for port in ports}
            for ports in (self._session.get_inputs(), self._session.get_outputs())
        )
        self._states: dict[str, np.ndarray] = {}
        self.reset()

    def reset(self) -> None:
        """An episode begins."""
        states = self.about["states"]
        self._states = {
            one["input"]: np.broadcast_to(np.float32(one["start"]), one["shape"]).astype(np.float32) for one in states
        }

    def act(self, observation: np.ndarray, depth: np.ndarray | None = None, age: float | None = None) -> np.ndarray:
        """The action (a,) for a scaled observation (k,) and depth (height, width) [m] of some age [s], if it sees."""
        given = {OBSERVATION: observation[None], **self._states}
        if depth is not None:
            given[DEPTH] = depth[None]
        if age is not None:
            given[AGE] = np.array([age], np.float32)
        action, *states = self._session.run(None, given)
        self._states = dict(zip(self._states, states, strict=True))
        return action[0]


def compare_steps(exported: ExportedPolicy, recorded: list[Sequence]) -> Parity:
    """Ask the file what the policy was asked, in the same order."""
    worst, largest, spent = 0.0, 0.0, []
    for sequence in recorded:
        exported.reset()
        for k, (observation, action) in enumerate(zip(sequence.observations, sequence.actions, strict=True)):
            begin = time.thread_time()
            depth, age = sequence.depths[k] if sequence.depths else None, sequence.ages[k] if sequence.ages else None
            answer = exported.act(observation, depth, age)
            spent.append(time.thread_time() - begin)
            worst = float(np.maximum(worst, np.abs(answer - action).max()))  # keeps NaN, unlike max
            largest = max(largest, float(np.abs(action).max()))
    return Parity(len(spent), len(recorded), worst, largest, 1000 * float(np.median(spent)))
