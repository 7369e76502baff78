"""``vinl eval-nav``: a navigator alone, in homes that it has never seen."""

from __future__ import annotations

import time
from dataclasses import asdict, dataclass

from vinl.cli.options import default_out, parse_options
from vinl.config.errors import InputError


@dataclass(frozen=True)
class Options:
    """Drive a navigation policy to goals in the kinematic environment and measure success, SPL and collisions:
    results.json and report.html."""

    policy: str = "nav"
    """A shipped navigation policy's name, the folder of a policy or run, or oracle: the path follower of vinl eval."""
    out: str | None = None
    """Folder for results.json and report.html (default: runs/eval-nav- and the policy, and a number where that holds
    the results of another command)."""
    floorplans: tuple[str, ...] = ()
    """Floor plans beside the generated homes; FILE:50-99 are plans 50 to 99 of a JSON file, FILE:50- those from 50 on,
    FILE:0-/2 every second."""
    sets: tuple[str, ...] = ()
    """Floors that are kept for judging, 20 of each: offices, dead_ends (homes whose rooms and doors make a tree) and
    narrow (homes with thick walls, narrow doors and gaps that no robot fits through)."""
    homes: int | None = None
    """Generated homes; 200 by default, none where --floorplans or --sets is given."""
    homes_seed: int = 1_000_000_000
    """Seed of the first home. Training takes seeds from its config's homes.seed on, 1 unless changed."""
    episodes: int = 1000
    """Episodes in each kind of homes."""
    seed: int = 0
    """Of starts, goals, headings and the camera's motion."""
    motion: str = "walking"
    """How camera and robot move: walking (as recorded from the walking robot on clutter), cancelled (the same, but a
    step that touches something is cancelled as a whole, as in the paper; walking robots can still turn), level
    (recorded on level ground), steady (not at all), or paper (roll and pitch redrawn within 30 deg at each step,
    perfect execution)."""
    sensors: str = "ideal"
    """Errors of the depth camera: ideal (none), realistic (a stereo camera: noise, holes, delay, a mount that is a
    little off), or a YAML file like configs/sensors/realistic.yaml."""
    drift: float = 0.0
    """The robot knows where it is from its own motion alone, and measures distances too long or too short by this
    fraction (0.02: 2 %); its heading drifts too, by up to 0.1 rad times this a metre. It arrives where the goal is."""
    clutter: float = 0.0
    """Share of the homes with blocks that the camera sees and the robot steps over."""
    min_distance: float = 5.0
    """Least geodesic distance from start to goal [m]."""
    max_distance: float = 30.0
    """Largest geodesic distance [m]."""
    steps: int = 250
    """Decisions of 0.5 s until an episode is out of time."""
    device: str = "auto"
    """Of homes and policy: cpu, cuda, or auto: cpu, the only one that repeats bit for bit."""


def main(argv: list[str]) -> int:
    """Run the evaluation and print its figures."""
    options = parse_options(Options, argv, "eval-nav")
    from rich.console import Console

    from vinl.config.output import SCHEMA, choose_out, describe_environment, strip_command, write_json, write_text
    from vinl.nav.environment import STUCK_STEPS
    from vinl.nav.evaluation import (
        NavEvaluation,
        build_homes,
        describe_episodes,
        describe_policy,
        evaluate_kind,
        load_navigator,
    )
    from vinl.nav.report import (
        aggregate_by_distance,
        aggregate_navigation,
        count_failures,
        print_failures,
        print_navigation_summary,
        render_navigation_report,
    )
    from vinl.policies.device import choose_device

    command = ["vinl", "eval-nav", *strip_command(argv)]
    out = choose_out(options.out, default_out("eval-nav", options.policy), command)
    homes = (0 if options.floorplans or options.sets else 200) if options.homes is None else options.homes
    if homes < 0:
        raise InputError(f"--homes must not be negative, got {homes}")
    if not 0.5 <= options.min_distance <= options.max_distance:
        raise InputError("--min-distance must lie between 0.5 m and --max-distance")
    distance = (options.min_distance, options.max_distance)
    rules = NavEvaluation(
        options.episodes,
        options.seed,
        options.motion,
        options.sensors,
        options.drift,
        distance,
        options.steps,
        clutter=options.clutter,
    )
    device = str(choose_device(options.device))
    policy = load_navigator(options.policy, device)
    config = describe_episodes(None if policy is None else policy.card, rules)
    console, begun = Console(), time.monotonic()
    results = []
    with Console(stderr=True).status("building homes") as status:
        stores = build_homes(
            config,
            homes,
            options.homes_seed,
            options.floorplans,
            device,
            lambda done, total: status.update(f"building homes: {done} of {total}"),
            options.sets,
        )
        for kind, store in stores.items():

            def show(done: int, total: int, kind: str = kind) -> None:
                status.update(f"{kind}: step {done} of at most {total}")

            results.append(evaluate_kind(policy, kind, store, config, show))
    records = [record for kind in results for record in kind.records]
    if not records:
        raise InputError("no home has a start and a goal as far apart as asked for; lower --min-distance")
    data = {
        "schema": SCHEMA,
        "command": command,
        "config": {
            **asdict(rules),
            "homes": homes,
            "homes_seed": options.homes_seed,
            "sets": options.sets,
            "stuck_steps": STUCK_STEPS,
        },
        "policies": {"navigation": describe_policy(policy)},
        "environment": describe_environment(),
        "aggregate": aggregate_navigation(records),
        "kinds": {
            kind.kind: {
                "aggregate": aggregate_navigation(kind.records),
                "distances": aggregate_by_distance(kind.records),
                "homes": len(kind.homes),
                "dropped": kind.dropped,
                "reasons": kind.reasons[:20],
                "left_out": kind.left_out,
                "failures": count_failures(kind.records),
            }
            for kind in results
        },
        "distances": aggregate_by_distance(records),
        "episodes": [asdict(record) for record in records],
        "timing": {"wall_seconds": round(time.monotonic() - begun, 2)},
    }
    write_json(out / "results.json", data)
    write_text(out / "report.html", render_navigation_report(data, [(kind.records, kind.traces) for kind in results]))
    print_navigation_summary(console, data)
    print_failures(console, {name: kind["failures"] for name, kind in data["kinds"].items()})
    for kind in results:
        if kind.dropped or kind.left_out:
            console.print(
                f"{kind.kind}: {kind.dropped} homes without a way, {kind.left_out} robots without a start were left out"
            )
        for reason in kind.reasons[:3]:
            console.print(f"  {reason}", soft_wrap=True)
    console.print(f"report {out / 'report.html'}; figures {out / 'results.json'}", soft_wrap=True)
    return 0
