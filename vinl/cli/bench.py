"""``vinl bench``: how fast the two training environments and the depth camera run on this machine."""

from __future__ import annotations

import json
import os
from dataclasses import dataclass
from typing import Any, Literal

from rich.console import Console
from rich.table import Table

from vinl.cli.options import Settings, parse_options, settings_first
from vinl.config.errors import InputError


@dataclass(frozen=True)
class LocoOptions:
    """Control steps per second of the training environment (MJX), with height scan and contact."""

    overrides: Settings = ()
    """Settings of the config as key=value."""
    num_envs: int = 4096
    """Robots in parallel."""
    seconds: float = 10.0
    """How long to measure, after compiling and warming up [s]."""
    config: str = "loco/rough"
    """Name of a shipped config or a YAML file."""
    device: str = "auto"
    """cpu, cuda, or auto: cuda where there is one."""
    json: bool = False
    """Print JSON instead of a table."""


@dataclass(frozen=True)
class DepthOptions:
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
    device: str = "auto"
    """cpu, cuda, or auto: cuda where there is one."""
    json: bool = False
    """Print JSON instead of a table."""


@dataclass(frozen=True)
class NavOptions:
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
    device: str = "auto"
    """cpu, cuda, or auto: cuda where there is one."""
    json: bool = False
    """Print JSON instead of a table."""


@dataclass(frozen=True)
class MemoryOptions:
    """GPU memory that a training of the navigation policy takes, predicted without a GPU [GB]: an upper estimate, as a
    compiled network keeps less for its backward pass."""

    overrides: Settings = ()
    """Settings of the config as key=value, such as num_envs=512 ppo.minibatches=16 homes.count=2000."""
    config: str = "nav/default"
    """Name of a shipped config or a YAML file."""
    json: bool = False
    """Print JSON instead of a table."""


def main(argv: list[str]) -> int:
    """Measure one of them and print its figures."""
    what = argv[0] if argv else "--help"
    if what in ("-h", "--help"):
        print("usage: vinl bench loco|nav|depth|memory [OPTIONS]\n\nvinl bench loco --help and so on list them.")
        return 0
    if what == "loco":
        options = parse_options(LocoOptions, settings_first(LocoOptions, argv[1:]), "bench loco")
        figures = _bench_loco(options)
    elif what == "depth":
        options = parse_options(DepthOptions, argv[1:], "bench depth")
        figures = _bench_depth(options)
    elif what == "nav":
        options = parse_options(NavOptions, settings_first(NavOptions, argv[1:]), "bench nav")
        figures = _bench_nav(options)
    elif what == "memory":
        options = parse_options(MemoryOptions, settings_first(MemoryOptions, argv[1:]), "bench memory")
        figures = _predict_memory(options)
    else:
        raise InputError(f"there is no benchmark {what!r}; choose loco, nav, depth or memory")
    _print(figures, what, options.json)
    return 0


def _bench_loco(options: LocoOptions) -> dict[str, Any]:
    _refuse(options.num_envs, "--num-envs")
    _refuse(options.seconds, "--seconds")
    device = _device(options.device)
    os.environ.setdefault("JAX_PLATFORMS", "cpu" if device == "cpu" else "cuda,cpu")
    from vinl.config.loader import load_config
    from vinl.loco.config import LocoConfig

    config = load_config(LocoConfig, options.config, options.overrides)
    from vinl.loco.benchmark import run_loco

    return run_loco(options.num_envs, options.seconds, config)


def _bench_nav(options: NavOptions) -> dict[str, Any]:
    for option in ("num_envs", "homes", "seconds"):
        _refuse(getattr(options, option), f"--{option.replace('_', '-')}")
    device = _device(options.device)
    if device == "cpu" and options.tree == "lbvh":
        raise InputError("--tree lbvh builds on a GPU; use sah on a CPU")
    from vinl.config.loader import load_config
    from vinl.nav.benchmark import run_nav
    from vinl.nav.config import NavConfig

    config = load_config(NavConfig, options.config, options.overrides)
    return run_nav(
        options.num_envs,
        options.homes,
        options.seconds,
        device,
        config,
        None if options.tree == "auto" else options.tree,
    )


def _predict_memory(options: MemoryOptions) -> dict[str, Any]:
    from vinl.config.loader import load_config
    from vinl.nav.benchmark import predict_memory
    from vinl.nav.config import NavConfig

    figures = predict_memory(load_config(NavConfig, options.config, options.overrides))
    return {f"{name}_gb": round(value, 2) for name, value in figures.items()}


def _bench_depth(options: DepthOptions) -> dict[str, Any]:
    for option in ("num_images", "width", "height", "homes", "seconds"):
        _refuse(getattr(options, option), f"--{option.replace('_', '-')}")
    from vinl.sensing.benchmark import run_depth

    return run_depth(
        options.num_images,
        options.width,
        options.height,
        _device(options.device),
        options.seconds,
        options.homes,
    )


def _device(name: str) -> str:
    from vinl.policies.device import choose_training_device

    return choose_training_device(name)


def _refuse(value: float | None, option: str) -> None:
    if value is not None and not value > 0:
        raise InputError(f"{option} must be positive, got {value}")


def _print(figures: dict[str, Any], what: str, as_json: bool) -> None:
    if as_json:
        print(json.dumps(figures, indent=2))
        return
    from vinl.cli.policies import flatten

    table = Table("measure", "value", title=f"vinl bench {what}")
    for key, value in flatten(figures).items():
        table.add_row(key, str(value))
    Console().print(table)
