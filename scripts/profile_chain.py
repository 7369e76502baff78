"""Where the time of ``vinl eval`` goes with a locomotor and a navigator that see.

    python scripts/profile_chain.py [--episodes 10] [--seeds 5] [--obstacles paper] [--loco NAME] [--nav NAME]

One process, the five shipped plans. Teacher and oracle drive, so that the robots walk as in a real evaluation; the
locomotor and the navigator see through their cameras and answer at 50 Hz and 2 Hz, but are not obeyed. Without names
they are untrained networks of the sizes in ``configs/loco/student.yaml`` and ``configs/nav/default.yaml``. Prints
processor time, not wall time: other work on the machine weighs less in it.
"""

from __future__ import annotations

import resource
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import tyro

from vinl.benchmark.protocol import LARGEST
from vinl.chain.batching import BatchedPolicy, ask_only
from vinl.chain.config import EvaluationConfig
from vinl.chain.depth_cameras import DepthCameras
from vinl.chain.episode import Recorder, draw_routes, draw_setup
from vinl.chain.navigators.oracle import OracleNavigator
from vinl.chain.robot import Robot
from vinl.chain.rollout import run_episodes
from vinl.chain.workers import one_thread
from vinl.config.loader import load_config
from vinl.gait.observation import SENSED_TABLE
from vinl.loco.config import LocoConfig
from vinl.nav.config import NavConfig
from vinl.policies.card import locomotion_card, navigation_card
from vinl.policies.depth_policy import DepthPolicy
from vinl.policies.io import load_policy
from vinl.policies.nav_actor import NavActor
from vinl.policies.stepping_actor import SteppingActor
from vinl.robot.cameras import NAVIGATION_CAMERA, Camera
from vinl.robot.observation import PROPRIOCEPTION_SIZE
from vinl.world.clutter import CLUTTER
from vinl.world.readers import load_floorplan, shipped_floorplans


@dataclass(frozen=True)
class Options:
    """Processor time of the parts of the chain."""

    episodes: int = 10
    """Start/goal pairs a plan."""
    seeds: int = 5
    """Repetitions."""
    obstacles: str = "paper"
    """Clutter preset."""
    loco: str | None = None
    """Locomotor that sees: a shipped policy or a folder."""
    nav: str | None = None
    """Navigator that sees: a shipped policy or a folder."""


class Watching(BatchedPolicy):
    """A locomotor that is asked for every action, and another one that is obeyed."""

    def __init__(self, seeing: DepthPolicy, obeyed: Any) -> None:
        super().__init__(seeing)
        self.card, self._obeyed = obeyed.card, BatchedPolicy(obeyed)

    def reset(self, which: Any) -> None:
        super().reset(which)
        self._obeyed.reset(which)

    def act(self, observation: np.ndarray, depth: Any = None) -> np.ndarray:
        timed("locomotor's network, 50 Hz", super().act)(observation[:, :PROPRIOCEPTION_SIZE], depth)
        self._obeyed.rows = self.rows
        return timed("(teacher's network)", self._obeyed.act)(observation)


class Guided(OracleNavigator):
    """A navigator that is asked for every decision, and the oracle, which is obeyed."""

    def __init__(self, seeing: DepthPolicy, locomotor: Watching) -> None:
        super().__init__()
        self.camera: Camera | None = seeing.camera
        self._seeing, self._locomotor = BatchedPolicy(seeing), locomotor

    def reset(self, episodes: Any) -> None:
        super().reset(episodes)
        self._seeing.reset(len(episodes))

    def act(self, observation: dict[str, Any]) -> np.ndarray:
        ask_only(self._locomotor.rows or (), self._seeing)  # type: ignore[arg-type]
        vector = np.concatenate([observation["goal"], observation["previous_action"]], 1)
        timed("navigator's network, 2 Hz", self._seeing.act)(vector, observation.get("depth"))
        return super().act(observation)


SPENT: dict[str, float] = {}


def timed(name: str | Callable[..., str], work: Callable[..., Any]) -> Callable[..., Any]:
    """The same function, its processor time noted under a name."""

    def run(*args: Any, **kwargs: Any) -> Any:
        began = time.thread_time()
        try:
            return work(*args, **kwargs)
        finally:
            key = name if isinstance(name, str) else name(*args)
            SPENT[key] = SPENT.get(key, 0.0) + time.thread_time() - began

    return run


def untrained_locomotor() -> DepthPolicy:
    """The student's network and camera, with random weights."""
    config = load_config(LocoConfig, "loco/student").student
    assert config is not None
    network, camera = config.network, config.camera.record().describe()
    actor = SteppingActor(camera, network.hidden, network.layers, network.memory)
    return DepthPolicy(actor, locomotion_card("untrained", actor.describe(), table=SENSED_TABLE, camera=camera))


def untrained_navigator() -> DepthPolicy:
    """The navigator's network and camera, with random weights."""
    config = load_config(NavConfig, "nav/default")
    camera = NAVIGATION_CAMERA if config.camera is None else config.camera.record()
    network = config.network
    actor = NavActor(
        network.vision,
        height=camera.height,
        width=camera.width,
        visual=network.visual,
        hidden=network.hidden,
        layers=network.layers,
        memory=network.memory,
        planes=network.planes,
    )
    return DepthPolicy(actor, navigation_card("untrained", actor.describe(), camera.describe()))


def main() -> None:
    options = tyro.cli(Options)
    loco = untrained_locomotor() if options.loco is None else load_policy(options.loco)
    nav = untrained_navigator() if options.nav is None else load_policy(options.nav)
    assert isinstance(loco, DepthPolicy) and isinstance(nav, DepthPolicy), "give policies that see"
    locomotor = Watching(loco, load_policy("teacher"))
    navigator = Guided(nav, locomotor)
    DepthCameras.look = timed(lambda cameras, *_: f"{cameras.camera.name} camera", DepthCameras.look)
    Robot.step = timed("physics and contacts", Robot.step)
    Recorder.count = timed("records", Recorder.count)
    config, records = EvaluationConfig(), []
    began = time.process_time()
    with one_thread():
        for plan in map(load_floorplan, shipped_floorplans()):
            routes = draw_routes(plan, options.episodes, config)
            cells = [(seed, k) for seed in range(options.seeds) for k in range(options.episodes)]
            for first in range(0, len(cells), LARGEST):
                some = cells[first : first + LARGEST]
                setups = [draw_setup(plan, routes[k], k, s, CLUTTER[options.obstacles], config) for s, k in some]
                done = run_episodes(plan, setups, locomotor, navigator, config)  # type: ignore[arg-type]
                records += [episode.record for episode in done]
    spent = time.process_time() - began
    walked, memory = sum(r.time_s for r in records), resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
    print(f"{len(records)} episodes, {walked:.0f} s walked, {sum(r.success for r in records)} reached their goal")
    print(f"{spent:.0f} s of one core, {1000 * spent / walked:.0f} ms a second walked, {memory:.2f} GB")
    SPENT["everything else"] = spent - sum(SPENT.values())
    for name, seconds in sorted(SPENT.items(), key=lambda item: -item[1]):
        print(f"{name:32s}{seconds:8.1f} s{100 * seconds / spent:6.1f} %")


if __name__ == "__main__":
    main()
