"""The two policies of the example, exported once for all processes of a session: it takes a minute."""

import pickle
from pathlib import Path

import pytest
from filelock import FileLock

from vinl.export.policy import Exported, export_policy

LOCO_STEPS, NAV_STEPS = 100, 40


@pytest.fixture(scope="session")
def exported(tmp_path_factory: pytest.TempPathFactory, worker_id: str) -> dict[str, tuple[Path, Exported]]:
    """``loco`` and ``nav``: the file and what the command knows of it."""
    base = tmp_path_factory.getbasetemp()
    folder = (base if worker_id == "master" else base.parent) / "exported"
    folder.mkdir(exist_ok=True)
    files = {name: folder / f"{name}.onnx" for name in ("loco", "nav")}
    steps = {"loco": LOCO_STEPS, "nav": NAV_STEPS}
    known = folder / "exported.pkl"
    with FileLock(folder / "lock"):
        if not known.exists():
            done = {name: (path, export_policy(name, path, steps[name])) for name, path in files.items()}
            known.write_bytes(pickle.dumps(done))
        return pickle.loads(known.read_bytes())
