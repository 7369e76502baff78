"""``vinl policies``: the trained policies that come with vinl."""

from __future__ import annotations

import json
import math
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from vinl.cli.options import parse_options

if TYPE_CHECKING:
    from rich.console import Console

    from vinl.policies.card import PolicyCard


@dataclass(frozen=True)
class Options:
    """List the trained policies, or show one of them."""

    name: Annotated[str | None, tyro.conf.Positional, tyro.conf.arg(metavar="[NAME]")] = None
    """Name of a shipped policy, a policy folder, or the folder of a training run; all shipped ones by default."""
    json: bool = False
    """Print the whole card, or all of them, as JSON."""


def main(argv: list[str]) -> int:
    """Print the table of shipped policies or one card."""
    options = parse_options(Options, argv, "policies")
    from rich.console import Console

    from vinl.policies.card import read_card
    from vinl.policies.io import find_policy, list_policies

    names = list_policies() if options.name is None else [options.name]
    cards = [read_card(find_policy(name)) for name in names]
    if options.json:
        plain = [asdict(card) for card in cards]
        print(json.dumps(plain if options.name is None else plain[0], indent=2))
        return 0
    console = Console()
    if options.name is not None:
        _print_card(console, cards[0], options.name)
    elif not cards:
        console.print("no policy is shipped with this version; train one: vinl train-loco --stage 1")
    else:
        _print_table(console, cards)
    return 0


def describe_senses(card: PolicyCard) -> str:
    """What a policy sees, in a few words."""
    if card.camera is not None:
        seen = card.camera
        degrees = math.degrees(seen["hfov"])
        return f"depth {seen['width']} x {seen['height']}, {degrees:.0f} deg, to {seen['far']:g} m"
    return "the true ground" if card.gait is not None and card.gait.get("map", True) else "nothing"


def headline(card: PolicyCard) -> str:
    """The figures that tell most, or a dash."""
    figures = card.evaluation
    if card.kind == "navigation" and "generated_walking" in figures:
        found = figures["generated_walking"]
        return f"success {found['success']:.1%}, SPL {found['spl']:.2f} in new homes"
    found = next((figures[name] for name in ("blocks_straight", "blocks") if name in figures), None)
    if card.kind == "locomotion" and found is not None:
        return f"{found['foot_block_per_m']:.2f} foot contacts/m on blocks, falls {found['falls']:.0%}"
    return "-"


def _print_table(console: Console, cards: list[PolicyCard]) -> None:
    from rich import box
    from rich.table import Table

    table = Table("name", "sees", "samples", "measured", box=box.SIMPLE_HEAD, pad_edge=False)
    for kind in ("locomotion", "navigation"):
        table.add_row(f"[bold]{kind}[/]")
        for card in cards:
            if card.kind == kind:
                table.add_row(f"  {card.name}", describe_senses(card), count(card.samples), headline(card))
    console.print(table)
    console.print(
        "vinl policies NAME: one of them; --json: its whole card. Measured alone, in MuJoCo C.", soft_wrap=True
    )


def _print_card(console: Console, card: PolicyCard, given: str) -> None:
    """One screen; the whole is in the JSON, by the name or folder that was given."""
    from rich import box
    from rich.table import Table
    from rich.text import Text

    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, show_header=False)
    observed = ", ".join(f"{row['name']} ({row['size']})" for row in card.observation)
    rows: dict[str, Any] = {
        "policy": f"{card.name}, {card.kind}, {count(card.samples)} samples",
        "network": card.network.get("class"),
        "sees": describe_senses(card),
        "observes": f"{card.observation_size} numbers: {observed}",
    }
    if card.camera is not None:
        mount = ", ".join(f"{x:g}" for x in card.camera["position"])
        rows["camera"] = f"at {mount} m on the trunk, {math.degrees(card.camera['pitch_down']):.0f} deg down"
    for key, value in card.action.items():
        shown = value if not isinstance(value, list) else f"[{', '.join(f'{x:.3g}' for x in value)}]"
        rows[_UNITS.get(key, key)] = f"{shown:.4g}" if isinstance(shown, float) else str(shown)
    for name, found in card.evaluation.items():
        figures = {k: v for k, v in found.items() if isinstance(v, (int, float)) and k in _SHOWN}
        rows[name] = ", ".join(f"{k} {v:.3g}" for k, v in figures.items()) or "-"
    for key, value in rows.items():
        table.add_row(Text(key), Text(str(value)))
    console.print(table)
    console.print(f"the whole card: vinl policies {given} --json; vinl.load_policy({given!r})", soft_wrap=True)


_UNITS = {
    "scale": "action scale [rad]",
    "default_pose": "default pose [rad]",
    "kp": "kp [N m/rad]",
    "kd": "kd [N m s/rad]",
    "forward_speed": "forward speed [m/s]",
    "yaw_rate": "yaw rate [rad/s]",
}
_SHOWN = ("success", "spl", "falls", "foot_block_per_m", "leg_block_per_m", "foot_collisions_per_m", "collisions")
"""Figures of a measurement that are shown; the card has more."""


def flatten(tree: dict[str, Any], prefix: str = "") -> dict[str, Any]:
    """Nested mappings to one, keys joined by dots; figures rounded to four digits."""
    flat: dict[str, Any] = {}
    for key, value in tree.items():
        if isinstance(value, dict):
            flat |= flatten(value, f"{prefix}{key}.")
        else:
            flat[f"{prefix}{key}"] = f"{value:.4g}" if isinstance(value, float) else value
    return flat


def count(number: int) -> str:
    """A large whole number as people say it: 128 M."""
    for size, unit in ((10**9, "G"), (10**6, "M"), (10**3, "k")):
        if number >= size:
            return f"{number / size:.3g} {unit}"
    return str(number)
