"""A small training ground that compiles in seconds."""

import pytest

from vinl.config.loader import load_config
from vinl.loco.config import LocoConfig

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
