"""``vinl bench``: how fast training physics and the depth camera run on this machine."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any

from rich.console import Console
from rich.table import Table

from vinl.cli.options import parse_options
from vinl.cli.policies import flatten
from vinl.config.errors import InputError


@dataclass(frozen=True)
class LocoOptions:
    """Control steps per second of the training environment (MJX), with height scan and contact."""

    num_envs: int = 4096
    """Robots in parallel."""
    steps: int = 200
    """Control steps (20 ms each) to measure, after warming up."""
    config: str = "loco/rough"
    """Name of a shipped config or a YAML file."""
    device: str = "auto"
    """cpu, cuda, or auto: cuda where there is one."""
    json: bool = False
    """Print JSON instead of a table."""


@dataclass(frozen=True)
class DepthOptions:
    """Depth images per second over house meshes, and the share of a bare ray kernel's speed."""

    num_envs: int | None = None
    """Cameras in one launch (default: 4096 on a GPU, 16 on a CPU)."""
    size: int = 64
    """Side of the square image [pixels]."""
    seconds: float = 2.0
    """How long to measure [s]."""
    device: str = "auto"
    """cpu, cuda, or auto: cuda where there is one."""
    json: bool = False
    """Print JSON instead of a table."""


def main(argv: list[str]) -> int:
    """Measure one of the two and print its figures."""
    what = argv[0] if argv else "--help"
    if what in ("-h", "--help"):
        print("usage: vinl bench loco|depth [OPTIONS]\n\nvinl bench loco --help and vinl bench depth --help list them.")
        return 0
    if what == "loco":
        options = parse_options(LocoOptions, argv[1:], "bench loco")
        _refuse(options.num_envs, "--num-envs")
        _refuse(options.steps, "--steps")
        from vinl.loco.benchmark import run

        figures = run(options)
    elif what == "depth":
        options = parse_options(DepthOptions, argv[1:], "bench depth")
        _refuse(options.num_envs, "--num-envs")
        _refuse(options.size, "--size")
        _refuse(options.seconds, "--seconds")
        from vinl.sensing.benchmark import run_depth

        figures = run_depth(options)
    else:
        raise InputError(f"there is no benchmark {what!r}; choose loco or depth")
    _print(figures, what, options.json)
    return 0


def _refuse(value: float | None, option: str) -> None:
    if value is not None and not value > 0:
        raise InputError(f"{option} must be positive, got {value}")


def _print(figures: dict[str, Any], what: str, as_json: bool) -> None:
    if as_json:
        print(json.dumps(figures, indent=2))
        return
    table = Table("measure", "value", title=f"vinl bench {what}")
    for key, value in flatten(figures).items():
        table.add_row(key, str(value))
    Console().print(table)
