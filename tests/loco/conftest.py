"""A small training ground that compiles in seconds."""

from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from types import ModuleType

import jax
import pytest
from first_state import first_state

from vinl.config.loader import load_config
from vinl.gait.config import GaitConfig
from vinl.loco.config import LocoConfig
from vinl.loco.environment import LocoEnvironment
from vinl.policies.card import locomotion_card
from vinl.policies.io import save_policy
from vinl.policies.networks import StepActor

SMALL = [
    "num_envs=8",
    "ppo.steps=4",
    "terrain.levels=2",
    "terrain.columns=2",
    "terrain.slope=0.5",
    "terrain.rough_slope=0",
    "terrain.stairs_up=0",
    "terrain.stairs_down=0",
    "terrain.discrete=0",
    "terrain.walls=0.5",
    "iterations=3",
]


@pytest.fixture(scope="session")
def small_overrides() -> list[str]:
    """Overrides of ``loco/rough`` for eight robots on four tiles."""
    return SMALL


@pytest.fixture(scope="session")
def small_config() -> LocoConfig:
    """Eight robots on four tiles."""
    return load_config(LocoConfig, "loco/rough", SMALL)


@pytest.fixture(scope="session")
def walker(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An untrained policy that knows the gait of the trainings."""
    network = StepActor()
    card = locomotion_card("walker", network.describe(), gait=asdict(GaitConfig()))
    return save_policy(tmp_path_factory.mktemp("policies") / "walker", network, card)


@pytest.fixture
def share_environment(monkeypatch: pytest.MonkeyPatch):
    """``share_environment(module, env)``: what the module trains starts one environment anew instead of making its own,
    because to compile one takes most of the time. Returns the function that does so."""

    def share(module: ModuleType, env: LocoEnvironment) -> Callable[..., LocoEnvironment]:
        def start(config: LocoConfig = env.config) -> LocoEnvironment:
            env.set_rewards(config.rewards)
            env.set_noise(1.0)
            env.simulation.set_solid(True)
            env.state = jax.device_put(first_state(env)(jax.random.PRNGKey(config.seed)), jax.devices()[0])
            env.take_lost()
            return env

        monkeypatch.setattr(module, "LocoEnvironment", start)
        return start

    return share
