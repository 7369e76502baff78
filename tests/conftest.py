"""Test settings: array shapes are checked, JAX and torch share two cores, every test runs in a folder of its own."""

from __future__ import annotations

import gc
import hashlib
import math
import os
import platform
import sys
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING

import hypothesis
import own_bytecode
import pytest
import sparing_checks
from beartype import BeartypeConf, beartype
from jaxtyping import install_import_hook

if TYPE_CHECKING:
    from collections.abc import Callable, Generator

    import mujoco

    from vinl.world.boxes import Boxes

gc.disable()  # until all is imported, which stays

for _name, _value in {
    "JAX_PLATFORMS": "cpu",
    "XLA_FLAGS": "--xla_cpu_multi_thread_eigen=false "
    "--xla_backend_optimization_level=0 --xla_cpu_use_fusion_emitters=false "  # compiles in a third of the time
    "intra_op_parallelism_threads=1",  # no flag of XLA: what follows it is not read
    "OMP_NUM_THREADS": "1",
    "MPLBACKEND": "Agg",
    "NO_COLOR": "1",
    "COLUMNS": "120",
}.items():
    os.environ.setdefault(_name, _value)


def _checked_modules() -> list[str]:
    """All modules of vinl but those with kernels: Warp and Triton compile a function's source and bear no wrapper."""
    root = Path(__file__).resolve().parent.parent
    files = [p for p in sorted((root / "vinl").glob("*/**/*.py")) if p.name != "__init__.py"]
    plain = [p for p in files if not any(kernel in p.read_text() for kernel in ("@wp.", "@triton."))]
    return [".".join(p.relative_to(root).with_suffix("").parts) for p in plain]


_checker = ModuleType("vinl_type_checker")
_checker.check = beartype(conf=BeartypeConf(is_pep484_tower=True))  # type: ignore[attr-defined]  # an int is a float
sys.modules["vinl_type_checker"] = _checker
sparing_checks.install()
own_bytecode.install()
install_import_hook(_checked_modules(), "vinl_type_checker.check")  # before the first import of vinl in this process

pytest_plugins = ["small_home"]

hypothesis.settings.register_profile(
    "quick", max_examples=25, derandomize=True, deadline=None, database=None, print_blob=False
)
hypothesis.settings.load_profile("quick")


def pytest_configure(config: pytest.Config) -> None:
    """Keep XLA's compiled programs beside pytest's cache: the second run starts in a fraction of the time."""
    os.environ.setdefault("JAX_COMPILATION_CACHE_DIR", str(config.rootpath / ".pytest_cache" / "xla" / _processor()))
    os.environ.setdefault("JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS", "0.5")


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """The garbage collector leaves out what was imported: a million objects of libraries, and JAX collects often."""
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.enable()


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Files with slow tests first: what is left for the end is short, and no process waits long for the other."""
    slow = {item.path for item in items if item.get_closest_marker("slow")}
    items.sort(key=lambda item: item.path not in slow)


def pytest_runtest_setup() -> None:
    """Shapes and types of the first calls of every function are checked anew in each test."""
    sparing_checks.begin_test()


def _processor() -> str:
    """Compiled programs fit one kind of processor; a checkout may move to another."""
    info = Path("/proc/cpuinfo")
    flags = (
        [line for line in info.read_text().splitlines() if line.startswith(("flags", "model name"))][:2]
        if (info.exists())
        else []
    )
    return hashlib.sha256("\n".join([platform.machine(), *flags]).encode()).hexdigest()[:12]


@pytest.fixture(autouse=True)
def in_own_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Whatever a test writes to a relative path lands in its temporary folder."""
    monkeypatch.chdir(tmp_path)


@pytest.fixture(scope="session")
def build_mujoco_boxes() -> Callable[[Boxes], tuple[mujoco.MjModel, mujoco.MjData]]:
    """A level floor with boxes in MuJoCo, whose rays other rays are measured against."""
    import mujoco

    def build(boxes: Boxes) -> tuple[mujoco.MjModel, mujoco.MjData]:
        spec = mujoco.MjSpec()
        spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, size=[0, 0, 1])
        for x, y, yaw, length, width, bottom, top in boxes.rows:
            spec.worldbody.add_geom(
                type=mujoco.mjtGeom.mjGEOM_BOX,
                pos=[x, y, (bottom + top) / 2],
                size=[length / 2, width / 2, (top - bottom) / 2],
                quat=[math.cos(yaw / 2), 0, 0, math.sin(yaw / 2)],
            )
        model = spec.compile()
        data = mujoco.MjData(model)
        mujoco.mj_forward(model, data)
        return model, data

    return build
