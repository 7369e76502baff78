"""A table: the figures of several rows on the same episodes, and how they compare."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from itertools import combinations
from typing import Any

from vinl.benchmark.metrics import aggregate_episodes, compare_rows
from vinl.benchmark.table_config import IDEAL, PaperFigures
from vinl.chain.records import Results
from vinl.config.output import SCHEMA, describe_environment

PLAN_FIGURES = ("success", "spl", "distance_m", "foot_collisions_per_m", "paper_foot_collisions_per_m")
"""Figures that the summary has for each floor plan too."""


@dataclass(frozen=True, eq=False)
class TableRow:
    """A row that was walked.

    Attributes:
        name: of its folder.
        title: for people.
        results: what came out.
        paper: what the paper found, if it has the row.
        command: that walked it, if it is another than the table's.
    """

    name: str
    title: str
    results: Results
    paper: PaperFigures | None = None
    command: Sequence[str] = ()


@dataclass(frozen=True, eq=False)
class Table:
    """Rows that were walked, side by side.

    Attributes:
        rows: at least one, in the order of the table.
        reference: name of the row that the others are compared with.
        left_out: rows that were not walked, and why.
        command: that walked the rows, or that puts rows of different commands together.
    """

    rows: Sequence[TableRow]
    reference: str
    left_out: Mapping[str, str]
    command: Sequence[str]


def summarise_table(table: Table) -> dict[str, Any]:
    """The table as plain data, without the episodes: small enough to be kept beside the code."""
    rows = table.rows
    config = {key: value for key, value in rows[0].results.config.items() if key != "obstacles"}
    min_metres = config["evaluation"]["min_metres"]
    return {
        "schema": SCHEMA,
        "command": list(table.command),
        "config": config,
        "environment": describe_environment(),
        "plans": [{"name": plan.name, "area_m2": round(plan.area_m2, 2)} for plan in rows[0].results.plans],
        "reference": table.reference,
        "rows": {row.name: _summarise_row(row, min_metres) for row in rows},
        "left_out": dict(table.left_out),
        "comparisons": [
            {
                "one": a.name,
                "other": b.name,
                "same_clutter": a.results.config["obstacles"] == b.results.config["obstacles"],
                **compare_rows(a.results.records, b.results.records, min_metres),
            }
            for a, b in combinations(rows, 2)
        ],
        "timing": {row.name: round(row.results.wall_seconds, 2) for row in rows},
    }


def _summarise_row(row: TableRow, min_metres: float) -> dict[str, Any]:
    results = row.results
    by_plan = {}
    for plan in results.plans:
        figures = aggregate_episodes([r for r in results.records if r.plan == plan.name], min_metres)
        by_plan[plan.name] = {name: figures[name]["mean"] for name in PLAN_FIGURES} | {
            "falls": figures["falls"],
            "episodes": figures["episodes"],
            "failures": figures["failures"],
        }
    return {
        "title": row.title,
        "policies": results.policies,
        "obstacles": results.config["obstacles"]["preset"],
        "paper": None if row.paper is None else asdict(row.paper),
        "aggregate": results.aggregate,
        "by_plan": by_plan,
    }


def find_comparison(data: Mapping[str, Any], one: str, other: str) -> tuple[dict[str, Any], int]:
    """The comparison of two rows, and the sign that turns its differences into ``one`` - ``other``."""
    for entry in data["comparisons"]:
        if (entry["one"], entry["other"]) == (one, other):
            return entry, 1
        if (entry["one"], entry["other"]) == (other, one):
            return entry, -1
    raise KeyError((one, other))


def summarise_faults(
    faults: Mapping[str, Sequence[str]], results: Sequence[Results], command: Sequence[str], min_metres: float
) -> dict[str, Any]:
    """What ``results.json`` of the matrix holds: each row's figures, and its differences from the ideal row over the
    same episodes. The episodes lie in the rows' folders."""
    rows: dict[str, Any] = {}
    for (name, settings), one in zip(faults.items(), results, strict=True):
        rows[name] = {"settings": list(settings), "aggregate": one.aggregate}
        if name != IDEAL:
            rows[name]["difference"] = compare_rows(one.records, results[0].records, min_metres)
    first = results[0]
    return {
        "schema": SCHEMA,
        "command": list(command),
        "policies": first.policies,
        "config": first.config,
        "environment": describe_environment(),
        "reference": IDEAL,
        "rows": rows,
    }
