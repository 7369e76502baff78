"""Which episodes of an evaluation were lost, how, and in which homes: by kind of home."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

from rich import box
from rich.console import Console
from rich.table import Table

from vinl.world.endings import SUCCESS

_WORST = 3
"""Homes named of every kind: those that most episodes were lost in."""


def count_failures(records: Sequence[Any], reasons: Sequence[str]) -> dict[str, Any]:
    """Of the episodes of one kind: ``lost``, how many by each of the other ``reasons``, and ``homes`` with their
    losses, the most first."""
    lost = [record for record in records if not record.success]
    homes = Counter(record.plan for record in lost)
    return {
        "episodes": len(records),
        "lost": len(lost),
        "reasons": {reason: sum(r.end_reason == reason for r in lost) for reason in reasons if reason != SUCCESS},
        "homes": dict(sorted(homes.items(), key=lambda item: (-item[1], item[0]))),
    }


def print_failures(console: Console, kinds: Mapping[str, Mapping[str, Any]]) -> None:
    """A row for each kind of home: episodes lost, how, and where most; nothing if none was lost."""
    if not any(kind["lost"] for kind in kinds.values()):
        return
    reasons = list(next(iter(kinds.values()))["reasons"])
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, title="failures by kind", title_justify="left")
    table.add_column("homes", no_wrap=True)
    for title in ("lost", *reasons):
        table.add_column(title, justify="right", no_wrap=True)
    table.add_column("most in")
    for name, kind in kinds.items():
        worst = ", ".join(f"{home}: {count}" for home, count in list(kind["homes"].items())[:_WORST])
        table.add_row(name, str(kind["lost"]), *(str(kind["reasons"][reason]) for reason in reasons), worst)
    console.print(table)
