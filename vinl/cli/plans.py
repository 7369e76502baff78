"""``vinl plans``: list the shipped floor plans, look at any plan, make up homes."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from tyro.conf import Positional

from vinl.cli.options import Settings, parse_options, settings_first
from vinl.config.errors import InputError

USAGE = """usage: vinl plans list                    the floor plans that travel with the package
       vinl plans show PATH ...           read a plan and draw it from above (vinl plans show --help)
       vinl plans generate --out DIR ...  make up homes, one file each (vinl plans generate --help)"""


@dataclass(frozen=True)
class ShowPlan:
    """Read a floor plan and draw it from above."""

    path: Positional[str]
    """PNG, PGM, ROS map YAML, JSON of ProcTHOR, HouseExpo or vectors (file.jsonl.gz:17 for one of many), mesh (GLB,
    OBJ, PLY, STL) or the name of a shipped plan."""
    out: str | None = None
    """PNG file for the picture; not drawn if left away."""
    resolution: float | None = None
    """Metres per pixel of a bare picture (0.05 if left away), metres per unit of a mesh (1 if left away)."""
    up: str | None = None
    """Which way is up in a mesh: x, y, z, -x, -y or -z; found by the kind of file and its shape if left away."""
    min_speck: int = 0
    """Drop pieces of wall of fewer pixels than this."""
    obstacles: str = "none"
    """Clutter to scatter: none, paper or dense."""
    episodes: int = 0
    """How many starts and goals to draw, with the way between them."""
    seed: int = 0
    """Seed of clutter, starts and goals."""


@dataclass(frozen=True)
class GeneratePlans:
    """Make up homes: rooms, doors and furniture from a seed, one JSON file each, and a picture of all of them."""

    overrides: Settings = ()
    """Settings of the config, for example area=[60,90] furniture_density=[0,0]."""
    out: str = "runs/homes"
    """Folder for home-SEED.json, and contact.png with all homes in it."""
    count: int = 20
    """How many homes."""
    seed: int = 0
    """Seed of the first home; the others follow. The same seed gives the same home."""
    layout: str = "home"
    """What floors: home, dead_ends (rooms and doors make a tree), office, or narrow (thick walls, narrow doors, gaps
    that no robot fits through)."""
    config: Path | None = None
    """YAML file of what homes are like (area, door_width, furniture_density, ...: see docs/floorplans.md), in place of
    --layout."""
    no_picture: bool = False
    """Leave contact.png away, a picture of the first 100 homes."""


@dataclass(frozen=True)
class ListPlans:
    """List the floor plans that travel with the package."""


def main(argv: list[str]) -> int:
    """Run ``vinl plans show PATH``, ``vinl plans generate`` or ``vinl plans list``.

    Raises:
        InputError: if the plan or an option cannot be used.
    """
    what = argv[0] if argv else "--help"
    if what == "show":
        _show_plan(parse_options(ShowPlan, argv[1:], "plans show"))
    elif what == "generate":
        _generate_plans(parse_options(GeneratePlans, settings_first(GeneratePlans, argv[1:]), "plans generate"))
    elif what == "list":
        parse_options(ListPlans, argv[1:], "plans list")
        _list_plans()
    elif what in ("-h", "--help"):
        print(USAGE)
    else:
        raise InputError(f"vinl plans {what}: choose 'show', 'generate' or 'list' (vinl plans --help)")
    return 0


def _list_plans() -> None:
    from vinl.world.readers import load_floorplan, shipped_floorplans

    for name in shipped_floorplans():
        plan = load_floorplan(name)
        print(f"{name:16} {plan.area_m2:5.0f} m2 free, {len(plan.labels):2} rooms, {len(plan.furniture):3} furniture")


def _generate_plans(options: GeneratePlans) -> None:
    from vinl.config.loader import build_config, dump_config, load_config
    from vinl.config.output import check_out
    from vinl.config.words import count_things
    from vinl.world.drawing import save_contact_sheet
    from vinl.world.homes import HomeConfig, generate_home
    from vinl.world.homes.config import layout_config
    from vinl.world.readers.own import write_floorplan

    if options.count < 1:
        raise InputError(f"--count {options.count}: give a number, 1 or more")
    if options.seed < 0:
        raise InputError(f"--seed {options.seed}: give a number, 0 or more")
    if options.config is None:
        config = build_config(HomeConfig, dump_config(layout_config(options.layout)), options.overrides)
    elif options.layout != "home":
        raise InputError("--config names what homes are like, and so does --layout; give one of them")
    else:
        config = load_config(HomeConfig, options.config, options.overrides)
    if options.config is None and config.layout != options.layout:
        raise InputError(f"layout={config.layout}: give --layout {config.layout}, which has sizes of its own")
    out = check_out(options.out)
    plans = [generate_home(options.seed + k, config) for k in range(options.count)]
    for plan in plans:
        write_floorplan(plan, out / f"{plan.name}.json")
    areas = [plan.area_m2 for plan in plans]
    size = " to ".join(dict.fromkeys(f"{area:.0f}" for area in (min(areas), max(areas))))
    print(f"{count_things(len(plans), 'home')} in {out}, {size} m2 of free floor")
    if not options.no_picture:
        print(f"  picture   {save_contact_sheet(plans[:100], out / 'contact.png')}")


def _show_plan(options: ShowPlan) -> None:
    import numpy as np

    from vinl.config.output import check_named
    from vinl.world.clutter import choose_clutter, scatter_blocks
    from vinl.world.free_space import FreeSpace, comfortable_path
    from vinl.world.readers import load_floorplan
    from vinl.world.start_goal import sample_start_goals

    if options.out is not None:
        check_named(options.out, "file")
    clutter = choose_clutter(options.obstacles)
    if options.seed < 0:
        raise InputError(f"--seed {options.seed}: give a number, 0 or more")
    plan = load_floorplan(options.path, options.resolution, options.min_speck, up=options.up)
    space = FreeSpace(plan)
    rng = np.random.default_rng(options.seed)
    pairs = sample_start_goals(plan, options.episodes, rng)
    points = np.array([point for pair in pairs for point in (pair.start, pair.goal)]).reshape(-1, 2)
    blocks = scatter_blocks(plan, clutter, rng, points)
    rows, columns = plan.frame.shape
    print(f"{plan.name}: {plan.area_m2:.1f} m2 of free floor in {plan.source}")
    print(f"  grid      {columns * plan.frame.resolution:.1f} m x {rows * plan.frame.resolution:.1f} m")
    print(f"  boxes     {len(plan.walls)} of walls, {len(plan.furniture)} of furniture, {len(blocks)} blocks")
    fraction = (space.regions == space.largest).sum() / space.traversable.sum()
    print(f"  regions   {space.regions.max()}; the largest holds {fraction:.0%} of where the robot can be")
    for pair in pairs:
        note = f" ({pair.note})" if pair.note else ""
        print(f"  episode   {pair.straight_m:.1f} m straight, {pair.geodesic_m:.1f} m on foot{note}")
    if options.out is not None:
        from vinl.world.drawing import save_floorplan

        paths = [
            comfortable_path(space.traversable, space.clearance, plan.frame, pair.start, pair.goal) for pair in pairs
        ]
        print(f"  picture   {save_floorplan(plan, options.out, blocks=blocks, start_goals=pairs, paths=paths)}")
