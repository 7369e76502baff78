"""Two shipped homes on the CPU, and a small environment in them."""

import pytest

from vinl.nav.config import HomesConfig, NavCameraConfig, NavConfig
from vinl.nav.home_store import HomeStore
from vinl.world.readers import load_floorplan


@pytest.fixture(scope="session")
def config() -> NavConfig:
    return NavConfig(
        num_envs=32,
        homes=HomesConfig(count=3, workers=0, goals=4, starts=128),
        camera=NavCameraConfig(width=16, height=12),
    )


@pytest.fixture(scope="session")
def homes(config) -> HomeStore:
    return HomeStore.from_plans([load_floorplan("harbour_flat"), load_floorplan("old_town")], config)
