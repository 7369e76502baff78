"""``vinl doctor``: versions, devices, and a one-second check of each part."""

from __future__ import annotations

import json
import platform
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from importlib import metadata

from rich.console import Console
from rich.text import Text

from vinl.cli import checks
from vinl.cli.app import TRAIN_HINT
from vinl.cli.options import parse_options

PACKAGES = ("mujoco", "torch", "warp-lang", "numpy", "trimesh", "scikit-image")
TRAIN_PACKAGES = ("jax", "mujoco-mjx", "rsl-rl-lib", "gymnasium", "tensorboard")
ABSENT = "not installed"


@dataclass(frozen=True)
class Options:
    """Check that every part of vinl works here. Exit code 1 if a part fails."""

    json: bool = False
    """Print JSON instead of tables."""


@dataclass(frozen=True)
class Result:
    """Outcome of a check: ``state`` is "ok", "failed" or "not installed"; ``seconds`` it took."""

    part: str
    state: str
    detail: str
    seconds: float


def main(argv: list[str]) -> int:
    """Print versions, devices and checks."""
    options = parse_options(Options, argv, "doctor")
    versions = {"python": platform.python_version()} | {name: _version(name) for name in ("vinl", *PACKAGES)}
    extra = {name: _version(name) for name in TRAIN_PACKAGES}
    results = [_check(part, function, needs) for part, function, needs in CHECKS]
    devices = _devices()  # after the checks: once JAX runs, starting a process (the video's encoder) draws a warning
    failed = any(result.state == "failed" for result in results)
    if options.json:
        report = {"versions": versions | extra, "devices": devices, "checks": [asdict(r) for r in results]}
        print(json.dumps(report, indent=2))
    else:
        _print(versions, extra, devices, results)
    return 1 if failed else 0


CHECKS: tuple[tuple[str, Callable[[], str], tuple[str, ...]], ...] = (
    ("configs", checks.check_configs, ()),
    ("floor plans", checks.check_plans, ()),
    ("depth camera", checks.check_depth, ()),
    ("physics", checks.check_physics, ()),
    ("policy", checks.check_policy, ()),
    ("video", checks.check_video, ()),
    ("training", checks.check_training, TRAIN_PACKAGES),
)
"""Name of the part, its check, and the packages of the train extra that it needs."""


def _check(part: str, function: Callable[[], str], needs: tuple[str, ...]) -> Result:
    missing = [name for name in needs if _version(name) == ABSENT]
    if missing:
        return Result(part, ABSENT, f"{', '.join(missing)} missing: {TRAIN_HINT}", 0.0)
    start = time.perf_counter()
    try:
        state, detail = "ok", function()
    except Exception as error:  # a check reports whatever went wrong and lets the others run
        state, detail = "failed", f"{type(error).__name__}: {error}"
    return Result(part, state, " ".join(detail.split()), round(time.perf_counter() - start, 2))


def _devices() -> dict[str, str]:
    found = {}
    for name, function in (("torch", checks.torch_devices), ("warp", checks.warp_devices), ("jax", checks.jax_devices)):
        try:
            found[name] = function()
        except ModuleNotFoundError:
            found[name] = ABSENT
        except Exception as error:  # a broken driver is what this command is there to show
            found[name] = f"{type(error).__name__}: {error}"
    return found


def _version(name: str) -> str:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return ABSENT


_MARKS = {"ok": ("✓", "green"), "failed": ("✗", "bold red"), ABSENT: ("-", "yellow")}


def _print(versions: dict[str, str], extra: dict[str, str], devices: dict[str, str], results: list[Result]) -> None:
    console = Console()
    main_versions = ", ".join(f"{name} {versions[name]}" for name in ("vinl", "python", "mujoco", "torch"))
    console.print(main_versions, highlight=False, soft_wrap=True)
    missing = [name for name, version in {**versions, **extra}.items() if version == ABSENT]
    if missing:
        console.print(f"not installed: {', '.join(missing)} (training needs {TRAIN_HINT})", soft_wrap=True)
    for name, device in devices.items():
        console.print(f"{name:<6}{device}", highlight=False, soft_wrap=True)
    for result in results:
        mark, style = _MARKS[result.state]
        line = Text(f"{mark} ", style).append(f"{result.part:<14}", "default").append(result.detail, "default")
        console.print(line, soft_wrap=True)
    failed = [result.part for result in results if result.state == "failed"]
    console.print(f"failed: {', '.join(failed)}" if failed else "all parts work")
