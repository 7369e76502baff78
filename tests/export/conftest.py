"""The two policies of the example, exported once a session."""

from pathlib import Path

import pytest

from vinl.export.policy import Exported, export_policy

LOCO_STEPS, NAV_STEPS = 100, 40


@pytest.fixture(scope="session")
def exported(tmp_path_factory: pytest.TempPathFactory) -> dict[str, tuple[Path, Exported]]:
    """``loco`` and ``nav``: the file and what the command knows of it."""
    folder = tmp_path_factory.mktemp("exported")
    files = {name: folder / f"{name}.onnx" for name in ("loco", "nav")}
    steps = {"loco": LOCO_STEPS, "nav": NAV_STEPS}
    return {name: (path, export_policy(name, path, steps[name])) for name, path in files.items()}
