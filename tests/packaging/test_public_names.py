"""``import vinl`` takes milliseconds, its public names are there, and array shapes are checked in tests."""

import subprocess
import sys

import numpy as np
import pytest
from jaxtyping import TypeCheckError

import vinl
from vinl.world.grid import GridFrame


@pytest.mark.parametrize("name", vinl.__all__)
def test_public_name(name: str):
    assert getattr(vinl, name) is not None


def test_names_are_listed_and_others_are_not_there():
    assert set(vinl.__all__) <= set(dir(vinl))
    with pytest.raises(AttributeError, match="no attribute 'load_polcy'"):
        _ = vinl.load_polcy


def test_import_is_light():
    code = "import sys; old = set(sys.modules); import vinl; print(*{m.split('.')[0] for m in set(sys.modules) - old})"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert set(run.stdout.split()) <= set(sys.stdlib_module_names) | {"vinl"}


def test_shapes_are_checked():
    frame = GridFrame(0.0, 0.0, 0.1, (5, 5))
    with pytest.raises(TypeCheckError):
        frame.cell(np.zeros((4, 3)))
