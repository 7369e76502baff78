"""A folder of recorded episodes, for all tests of the viewer."""

from pathlib import Path

import pytest

from vinl.cli.app import main

COMMAND = """eval --floorplans harbour_flat --loco rough --nav oracle --obstacles paper --episodes 2 --seeds 1
--workers 1 --record --set time_limit=1.2 --out"""


@pytest.fixture(scope="session")
def record_command() -> list[str]:
    """The command that records; its folder comes last."""
    return COMMAND.split()


@pytest.fixture(scope="session")
def folder(tmp_path_factory: pytest.TempPathFactory, record_command: list[str]) -> Path:
    """What it wrote."""
    out = tmp_path_factory.mktemp("recorded")
    assert main([*record_command, str(out)]) == 0
    return out
