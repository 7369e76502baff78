"""The same robot with one fault at a time, beside itself without any."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from rich import box
from rich.console import Console
from rich.table import Table

from vinl.benchmark.paired import compare_rows
from vinl.chain.config import EvaluationConfig
from vinl.chain.records import Results
from vinl.config.errors import InputError
from vinl.config.fields import closest
from vinl.config.loader import build_config
from vinl.config.output import SCHEMA
from vinl.config.versions import describe_environment

IDEAL = "ideal"
"""The row without faults."""

_NAME = re.compile(r"^[a-z0-9][a-z0-9_.-]*$")

_COLUMNS = (
    ("foot_collisions_per_m", "foot/m"),
    ("leg_contacts_per_m", "leg/m"),
    ("speed_rmse", "m/s"),
)


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
            if name == IDEAL or not _NAME.match(name):
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


def print_faults(console: Console, data: Mapping[str, Any]) -> None:
    """One line a fault."""
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    table.add_column("fault", overflow="fold")
    for title in ("success %", "falls %", *[title for _, title in _COLUMNS], "more foot/m", "n"):
        table.add_column(title, justify="right", no_wrap=True)
    for name, row in data["rows"].items():
        a, difference = row["aggregate"], row.get("difference")
        cells = [_number(a["success"]["mean"], 1, 100), _number(a["falls"], 1, 100)]
        cells += [_number(a[key]["mean"], 2) for key, _ in _COLUMNS]
        cells.append(
            "" if difference is None else _number(difference["foot_collisions_per_m"]["difference"], 2, sign="+")
        )
        table.add_row(name, *cells, str(a["episodes"]))
    console.print(table)


def _number(value: float | None, digits: int, factor: float = 1.0, sign: str = "") -> str:
    return "-" if value is None else f"{factor * value:{sign}.{digits}f}"
