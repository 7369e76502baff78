"""``vinl policies``: the trained policies that come with vinl."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from typing import Annotated, Any

import tyro
from rich.console import Console
from rich.table import Table
from rich.text import Text

from vinl.cli.options import parse_options
from vinl.policies.card import PolicyCard, read_card
from vinl.policies.io import find_policy, list_policies


@dataclass(frozen=True)
class Options:
    """List the trained policies, or show the card of one."""

    name: Annotated[str | None, tyro.conf.Positional, tyro.conf.arg(metavar="[NAME]")] = None
    """Name of a shipped policy, a policy folder, or the folder of a training run; all shipped ones by default."""
    json: bool = False
    """Print JSON instead of a table."""


def main(argv: list[str]) -> int:
    """Print the table of shipped policies or one card."""
    options = parse_options(Options, argv, "policies")
    names = list_policies() if options.name is None else [options.name]
    cards = [read_card(find_policy(name)) for name in names]
    if options.json:
        plain = [asdict(card) for card in cards]
        print(json.dumps(plain if options.name is None else plain[0], indent=2))
        return 0
    console = Console()
    if options.name is not None:
        _print_card(console, cards[0])
    elif not cards:
        console.print("no policy is shipped with this version; train one: vinl train-loco --stage 1")
    else:
        _print_table(console, cards)
    return 0


def _print_table(console: Console, cards: list[PolicyCard]) -> None:
    table = Table("name", "kind", "network", "samples", "evaluation")
    for card in cards:
        figures = "\n".join(f"{key}: {value}" for key, value in flatten(card.evaluation).items()) or "not measured"
        table.add_row(card.name, card.kind, str(card.network.get("class")), count(card.samples), Text(figures))
    console.print(table)
    console.print("vinl policies NAME shows a card whole; vinl.load_policy(NAME) loads it")


def _print_card(console: Console, card: PolicyCard) -> None:
    table = Table("field", "value", title=f"{card.name} ({card.kind})", show_lines=True)
    for key, value in asdict(card).items():
        if key == "observation":
            shown = "\n".join(f"{row['size']:>4}  {row['name']} [{row.get('unit', '')}]" for row in value)
        elif isinstance(value, dict):
            shown = "\n".join(f"{k}: {v}" for k, v in flatten(value).items())
        else:
            shown = count(value) if key == "samples" else str(value)
        table.add_row(key, Text(shown or "-"))
    console.print(table)


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
            return f"{number / size:.4g} {unit}"
    return str(number)
