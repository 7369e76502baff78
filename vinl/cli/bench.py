"""``vinl bench``: how fast the two training environments and the depth camera run on this machine."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

from rich.console import Console
from rich.table import Table

from vinl.cli.options import Settings, check_config, parse_options, settings_first
from vinl.config.errors import InputError


@dataclass(frozen=True)
class _Printed:
    """Options of every benchmark."""

    json: bool = False
    """Print JSON instead of a table."""


@dataclass(frozen=True)
class _Measured(_Printed):
    """Options of what is measured on a device."""

    device: str = "auto"
    """cpu, cuda, or auto: cuda where there is one."""


@dataclass(frozen=True)
class LocoOptions(_Measured):
    """Control steps per second of the training environment (MJX), with height scan and contact."""

    overrides: Settings = ()
    """Settings of the config as key=value."""
    num_envs: int = 4096
    """Robots in parallel."""
    seconds: float = 10.0
    """How long to measure, after compiling and warming up [s]."""
    config: str = "loco/rough"
    """Name of a shipped config or a YAML file."""


@dataclass(frozen=True)
class DepthOptions(_Measured):
    """Depth images per second over house meshes, and the fraction of a bare ray kernel's speed."""

    num_images: int | None = None
    """Images in one launch (default: 4096 on a GPU, 32 on a CPU)."""
    width: int = 64
    """Of the images [pixels]."""
    height: int = 64
    """Of the images [pixels]."""
    homes: int = 8
    """Homes that the images are spread over."""
    seconds: float = 2.0
    """How long to measure [s]."""


@dataclass(frozen=True)
class NavOptions(_Measured):
    """Steps per second of the navigation environment with a depth image each, and what its homes cost."""

    overrides: Settings = ()
    """Settings of the config as key=value."""
    num_envs: int | None = None
    """Robots in parallel (default: 4096 on a GPU, 32 on a CPU)."""
    homes: int | None = None
    """Homes that the robots are spread over (default: 1000 on a GPU, 16 on a CPU)."""
    seconds: float = 5.0
    """How long to measure [s]."""
    config: str = "nav/default"
    """Name of a shipped config or a YAML file."""
    tree: Literal["auto", "sah", "lbvh"] = "auto"
    """How the ray trees of the homes are built: sah on the host, lbvh on a GPU; auto is Warp's choice."""


@dataclass(frozen=True)
class MemoryOptions(_Printed):
    """GPU memory that a training of the navigation policy takes, predicted without a GPU [GB]: an upper estimate, as a
    compiled network keeps less for its backward pass."""

    overrides: Settings = ()
    """Settings of the config as key=value, such as num_envs=512 ppo.minibatches=16 homes.count=2000."""
    config: str = "nav/default"
    """Name of a shipped config or a YAML file."""


def main(argv: list[str]) -> int:
    """Measure one of them and print its figures."""
    what = argv[0] if argv else "--help"
    if what in ("-h", "--help"):
        print("usage: vinl bench loco|nav|depth|memory [OPTIONS]\n\nvinl bench loco --help and so on list them.")
        return 0
    if what not in _BENCHMARKS:
        raise InputError(f"there is no benchmark {what!r}; choose loco, nav, depth or memory")
    kind, measure = _BENCHMARKS[what]
    options = parse_options(kind, settings_first(kind, argv[1:]), f"bench {what}")
    figures = measure(options)
    if options.json:
        print(json.dumps(figures, indent=2))
        return 0
    from vinl.cli.policies import flatten

    table = Table("measure", "value", title=f"vinl bench {what}")
    for key, value in flatten(figures).items():
        table.add_row(key, str(value))
    Console().print(table)
    return 0


def _bench_loco(options: LocoOptions) -> dict[str, Any]:
    _refuse(options, "num_envs", "seconds")
    device = _device(options.device)
    os.environ.setdefault("JAX_PLATFORMS", "cpu" if device == "cpu" else "cuda,cpu")
    from vinl.config.loader import load_config
    from vinl.loco.config import LocoConfig

    check_config(options.config, "locomotion")
    config = load_config(LocoConfig, options.config, options.overrides)
    from vinl.loco.benchmark import run_loco

    return run_loco(options.num_envs, options.seconds, config)


def _bench_nav(options: NavOptions) -> dict[str, Any]:
    _refuse(options, "num_envs", "homes", "seconds")
    device = _device(options.device)
    if device == "cpu" and options.tree == "lbvh":
        raise InputError("--tree lbvh builds on a GPU; use sah on a CPU")
    from vinl.config.loader import load_config
    from vinl.nav.benchmark import run_nav
    from vinl.nav.config import NavConfig

    check_config(options.config, "navigation")
    config = load_config(NavConfig, options.config, options.overrides)
    tree = None if options.tree == "auto" else options.tree
    return run_nav(options.num_envs, options.homes, options.seconds, device, config, tree)


def _predict_memory(options: MemoryOptions) -> dict[str, Any]:
    from vinl.config.loader import load_config
    from vinl.nav.benchmark import predict_memory
    from vinl.nav.config import NavConfig

    check_config(options.config, "navigation")
    figures = predict_memory(load_config(NavConfig, options.config, options.overrides))
    return {f"{name}_gb": round(value, 2) for name, value in figures.items()}


def _bench_depth(options: DepthOptions) -> dict[str, Any]:
    _refuse(options, "num_images", "width", "height", "homes", "seconds")
    from vinl.sensing.benchmark import run_depth

    device = _device(options.device)
    return run_depth(options.num_images, options.width, options.height, device, options.seconds, options.homes)


def _device(name: str) -> str:
    from vinl.policies.device import choose_training_device

    return choose_training_device(name)


def _refuse(options: _Printed, *names: str) -> None:
    """Numbers that are not positive."""
    for name in names:
        value = getattr(options, name)
        if value is not None and not value > 0:
            raise InputError(f"--{name.replace('_', '-')} must be positive, got {value}")


_BENCHMARKS: dict[str, tuple[Any, Callable[[Any], dict[str, Any]]]] = {
    "loco": (LocoOptions, _bench_loco),
    "depth": (DepthOptions, _bench_depth),
    "nav": (NavOptions, _bench_nav),
    "memory": (MemoryOptions, _predict_memory),
}
"""Options of each benchmark, and what measures."""
