"""A table: which rows it has (who walks, through what clutter, with which fault), the figures of several rows on the
same episodes, and how they compare."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from itertools import combinations
from pathlib import Path
from typing import Any

from vinl.benchmark.metrics import aggregate_episodes, compare_rows
from vinl.chain.config import EvaluationConfig
from vinl.chain.navigators.base import ORACLE
from vinl.chain.records import Results
from vinl.config.errors import InputError
from vinl.config.loader import build_config, closest
from vinl.config.output import SCHEMA, describe_environment
from vinl.policies.card import CARD_FILE
from vinl.policies.io import list_policies
from vinl.world.clutter import choose_clutter

_NAME = re.compile(r"^[a-z0-9][a-z0-9_-]*$")
_FAULT = re.compile(r"^[a-z0-9][a-z0-9_.-]*$")

IDEAL = "ideal"
"""The row of a matrix of faults that has none."""


@dataclass(frozen=True)
class PaperFigures:
    """Mean and standard deviation over seeds, as published.

    Attributes:
        success: fraction of episodes that reached the goal [%].
        distance_m: path length walked [m].
        foot_collisions_per_m: by the paper's own rule [1/m].
    """

    success: tuple[float, float]
    distance_m: tuple[float, float]
    foot_collisions_per_m: tuple[float, float]


@dataclass(frozen=True)
class RowConfig:
    """One row.

    Attributes:
        title: what the report calls it.
        loco: locomotor: a shipped policy's name, or a policy folder.
        nav: navigator: oracle, a shipped navigation policy's name, or a policy folder.
        recovery: free robots of the learned navigator where they are stuck.
        paper: what the paper found; none for a row that it does not have.
    """

    title: str
    loco: str
    nav: str
    obstacles: str = "paper"
    recovery: bool = False
    paper: PaperFigures | None = None

    def __post_init__(self) -> None:
        choose_clutter(self.obstacles, f"row {self.title!r}: obstacles")

    @property
    def missing(self) -> str:
        """Why the row cannot be walked: which policy is not there; empty if all are."""
        shipped = list_policies()
        for name in (self.loco, self.nav):
            folders = (Path(name), Path(name) / "policy")  # "vinl/loco" may also be a folder of the source
            there = any((folder / CARD_FILE).is_file() for folder in folders)
            if name != ORACLE and name.removeprefix("vinl/") not in shipped and not there:
                return f"policy {name} is not shipped with this version"
        return ""


@dataclass(frozen=True)
class TableConfig:
    """A table.

    Attributes:
        reference: the row that the others are compared with.
        rows: by name; a row's files lie in a folder of this name.
    """

    reference: str
    rows: dict[str, RowConfig] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if not self.rows:
            raise InputError("a table needs at least one row")
        for name in self.rows:
            if not _NAME.match(name) or name == "plans":
                raise InputError(f"row {name!r}: a name has small letters, digits, - and _ only, and is not plans")
        if self.reference not in self.rows:
            raise InputError(f"reference {self.reference!r} is none of the rows{closest(self.reference, self.rows)}")

    def choose(self, names: Sequence[str], nav: str | None) -> TableConfig:
        """Some of the rows, the learned navigator replaced where one is given; rows that become equal stand once.

        Raises:
            InputError: there is no row of a name.
        """
        for name in names:
            if name not in self.rows:
                raise InputError(f"--rows: there is no row {name!r}{closest(name, self.rows)}; {', '.join(self.rows)}")
        chosen: dict[str, RowConfig] = {}
        seen: list[RowConfig] = []
        for name, row in self.rows.items():
            if nav is not None and row.nav != ORACLE:
                row = replace(row, nav=nav, recovery=row.recovery and nav != ORACLE)
            who = replace(row, title="", paper=None)
            if (not names or name in names) and who not in seen:
                chosen[name] = row
                seen.append(who)
        return TableConfig(self.reference if self.reference in chosen else next(iter(chosen)), chosen)


@dataclass(frozen=True)
class FaultMatrix:
    """Which faults are tried.

    Attributes:
        rows: by name, which is the name of the row's folder; each is settings of an ``EvaluationConfig``, as on the
            command line.

    Raises:
        InputError: there is no row, a name is none for a folder, or a row has no settings, or impossible ones.
    """

    rows: dict[str, tuple[str, ...]]

    def __post_init__(self) -> None:
        if not self.rows:
            raise InputError("rows: no fault is named")
        for name, settings in self.rows.items():
            if not settings:
                raise InputError(f"rows.{name}: no setting; give one, such as faults.kp_scale=0.8")
            build_config(EvaluationConfig, {}, settings, source=f"rows.{name}")
            if name == IDEAL or not _FAULT.match(name):
                raise InputError(
                    f"rows: {name!r} cannot name a fault; take small letters, digits and _.- (ideal is the row without)"
                )

    def choose(self, names: Sequence[str]) -> dict[str, tuple[str, ...]]:
        """The rows of these names, or all; the one without faults comes first.

        Raises:
            InputError: there is no such row.
        """
        for name in names:
            if name not in self.rows and name != IDEAL:
                known = ", ".join(self.rows)
                raise InputError(f"--rows: there is no fault {name!r}{closest(name, self.rows)}; known: {known}")
        return {IDEAL: ()} | {k: v for k, v in self.rows.items() if not names or k in names}


PLAN_FIGURES = ("success", "spl", "distance_m", "foot_collisions_per_m", "paper_foot_collisions_per_m")
"""Figures that the summary has for each floor plan too."""


@dataclass(frozen=True, eq=False)
class TableRow:
    """A row that was walked.

    Attributes:
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
