"""``vinl play``: the chain, or a recording of it, live in the browser."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

import tyro

from vinl.cli.options import Settings, load_rules, parse_options, settings_first
from vinl.config.errors import InputError

if TYPE_CHECKING:
    from vinl.viewer.viewer import Viewer


@dataclass(frozen=True)
class Options:
    """Watch the robot in the browser and drive it: click a goal, or use the keyboard and sliders; drop blocks, push it,
    pause, go step by step; see what its cameras see. Or scrub through an episode that vinl eval --record kept."""

    overrides: Settings = ()
    """Rules of the evaluation in place of the config's, for example faults.action_delay=0.02."""
    plan: str | None = None
    """Floor plan: a shipped one's name, or a file (see vinl eval); by default the first shipped one."""
    terrain: str | None = None
    """Open ground in place of a floor plan: flat, blocks, litter, or bars across a lane, 0.05 to 0.2 m high."""
    loco: Annotated[str | None, tyro.conf.arg(aliases=("--policy",))] = None
    """Locomotion policy: a shipped one's name, a policy folder or a run folder; by default the best that is shipped."""
    nav: str | None = None
    """Navigation policy: the same, or oracle (follows the shortest path); by default nav, on open ground oracle."""
    obstacles: str = "paper"
    """Clutter in a floor plan: none, paper (1 block per m2) or dense (1.5 per m2)."""
    density: float | None = None
    """On open ground: blocks per m2, 0 to 4 (1 by default), or objects of litter per m2, 0 to 30 (10 by default)."""
    seed: int = 0
    """Of clutter and start; the same as in vinl eval."""
    sensors: str | None = None
    """Errors of the depth cameras, as in vinl eval: ideal (none, the default), realistic, or a YAML file."""
    drift: float | None = None
    """Of the odometry by which a learned navigator knows where it is, as in vinl eval (0.02: 2 %; default: 0)."""
    config: str | None = None
    """Rules of the evaluation: a shipped config or a YAML file (default: eval/default)."""
    replay: str | None = None
    """Folder of vinl eval --record: show its episodes instead of a live robot."""
    episode: int = 0
    """Which episode of the folder, counted from 0 in the order of results.json."""
    pace: float = 1.0
    """Speed of time at the beginning, 0.05 to 4; 1 is real time."""
    port: int = 8080
    """Port to listen on; 0 takes any free one."""
    host: str = "127.0.0.1"
    """Address to listen on; 0.0.0.0 lets other machines in."""


def main(argv: list[str]) -> int:
    """Show the page until Ctrl-C."""
    options = parse_options(Options, settings_first(Options, argv), "play")
    _check(options)
    from rich.console import Console

    from vinl.viewer.play import require_viser

    require_viser("vinl play")
    console = Console()
    with console.status("loading"):
        viewer = _open(options)
    console.print(f"open {viewer.url} in a browser; Ctrl-C ends it", soft_wrap=True, highlight=False)
    try:
        viewer.wait()
    except KeyboardInterrupt:
        console.print("closed")
    finally:
        viewer.close()
    return 0


_RULES = ("sensors", "drift", "config", "obstacles", "density", "seed")
"""Options of a live robot's surroundings and rules, which a recording brings along."""


def _is_given(options: Options, name: str) -> bool:
    return getattr(options, name) != getattr(Options, name)


def _check(options: Options) -> None:
    given = [name for name in ("plan", "terrain", "replay") if getattr(options, name) is not None]
    if len(given) > 1:
        raise InputError(f"--{given[0]} and --{given[1]} do not go together; give one of them")
    if options.replay is not None and (options.loco is not None or options.nav is not None):
        raise InputError("--replay shows what was recorded; it takes no --loco, --policy or --nav")
    if options.replay is not None and (options.overrides or any(_is_given(options, name) for name in _RULES)):
        raise InputError(f"--replay shows what was recorded; it takes no --{', --'.join(_RULES)} or settings")
    if not 0 <= options.port <= 65535:
        raise InputError(f"--port must lie between 0 and 65535, got {options.port}")
    if options.seed < 0:
        raise InputError(f"--seed must not be negative, got {options.seed}")


def _open(options: Options) -> Viewer:
    from vinl.viewer.play import play, replay

    server = {"host": options.host, "port": options.port}
    if options.replay is not None:
        return replay(options.replay, options.episode, pace=options.pace, **server)
    rules = "eval/default" if options.config is None else options.config
    return play(
        options.plan,
        options.loco,
        options.nav,
        options.obstacles,
        options.seed,
        terrain=options.terrain,
        density=options.density,
        pace=options.pace,
        config=load_rules(rules, options.overrides, options.sensors, options.drift),
        **server,
    )
