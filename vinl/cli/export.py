"""``vinl export``: a policy as an ONNX file, or a home as MJCF to try it in."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from vinl.cli.options import parse_options
from vinl.config.errors import InputError


@dataclass(frozen=True)
class Options:
    """Write a policy as an ONNX file that runs without vinl, checked on steps recorded in MuJoCo C; or, with --scene, a
    home and episodes for MuJoCo alone. docs/deploy.md says what a robot needs around it."""

    policy: Annotated[str | None, tyro.conf.Positional, tyro.conf.arg(metavar="[POLICY]")] = None
    """A shipped policy's name (vinl policies), a policy folder or the folder of a training run."""
    out: str | None = None
    """File that ends with .onnx, POLICY.onnx by default; with --scene a folder for home.xml and episodes.json, the
    plan's name by default."""
    steps: int = 1000
    """Control steps (of a navigation policy: decisions) that the file has to answer as the policy does."""
    scene: str | None = None
    """Floor plan to write in place of a policy: a shipped one's name or a file, see vinl plans."""
    episodes: int = 10
    """With --scene: start/goal pairs, those of vinl eval."""
    obstacles: str = "paper"
    """With --scene: clutter: none, paper or dense."""
    seed: int = 0
    """With --scene: of clutter, heading and joint angles at the start."""
    resolution: float | None = None
    """With --scene: metres per pixel of a floor plan that is a bare picture; 0.05 if not given."""


def main(argv: list[str]) -> int:
    """Write the files and say what they hold; 1 if the ONNX file does not answer as the policy does."""
    options = parse_options(Options, argv, "export")
    if (options.policy is None) == (options.scene is None):
        raise InputError("give a policy (vinl export loco --out loco.onnx) or a home (--scene harbour_flat --out DIR)")
    return _export_policy(options, options.policy) if options.policy else _export_home(options, str(options.scene))


def _export_policy(options: Options, name: str) -> int:
    from rich.console import Console
    from rich.progress import Progress

    from vinl.export.parity import LIMIT
    from vinl.export.policy import ParityError, export_policy

    console, out = Console(), f"{Path(name).resolve().name}.onnx" if options.out is None else options.out
    with Progress(console=console, transient=True, disable=not console.is_terminal) as progress:
        task = progress.add_task("walking", total=options.steps)
        try:
            done = export_policy(name, out, options.steps, lambda steps: progress.update(task, completed=steps))
        except ParityError as error:
            console.print(f"error: {error}", soft_wrap=True)
            return 1
    size = Path(out).stat().st_size / 1e6
    console.print(f"{out}: {done.title}, {size:.1f} MB, weights {done.weights[:12]}", soft_wrap=True)
    for name, ports in (("inputs", done.inputs), ("outputs", done.outputs)):
        console.print(f"  {name:<9}" + ", ".join(f"{port} {shape}" for port, shape in ports.items()), soft_wrap=True)
    parity = done.parity
    console.print(
        f"  {'parity':<9}{parity.steps:,} steps of {parity.episodes} episodes in MuJoCo C: actions differ by "
        f"{parity.worst:.1e} at most, of up to {parity.largest:.2g}; limit {LIMIT:g}",
        soft_wrap=True,
    )
    console.print(f"  {'speed':<9}{parity.step_ms:.2f} ms a step on one core (onnxruntime)", soft_wrap=True)
    return 0


def _export_home(options: Options, name: str) -> int:
    from vinl.config.words import count_things
    from vinl.export.home import export_home
    from vinl.world.readers import load_floorplan

    plan = load_floorplan(name, options.resolution)
    out = plan.name if options.out is None else options.out
    folder = export_home(plan, out, options.episodes, options.obstacles, options.seed)
    episodes = count_things(options.episodes, "episode")
    print(f"{folder}: {plan.name} as home.xml, {episodes} with clutter {options.obstacles}")
    return 0
