"""Which rows a table has: who walks, through what clutter, and what the paper found; or with which fault."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from vinl.chain.config import EvaluationConfig
from vinl.chain.navigators.base import ORACLE
from vinl.config.errors import InputError
from vinl.config.loader import build_config, closest
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
        obstacles: clutter preset.
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
        for name, row in self.rows.items():
            if names and name not in names:
                continue
            changed = (
                row
                if nav is None or row.nav == ORACLE
                else replace(row, nav=nav, recovery=row.recovery and nav != ORACLE)
            )
            same = [
                r for r in chosen.values() if replace(r, title="", paper=None) == replace(changed, title="", paper=None)
            ]
            if not same:
                chosen[name] = changed
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
