"""What lies in folders of ``vinl eval``: one row, or a table of rows, each from one folder or from several shares."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from vinl.benchmark.journal import EPISODES_FILE, RUN_FILE
from vinl.benchmark.merge import TABLE_FILE, Part, group_parts, merge_parts, read_part
from vinl.benchmark.outputs import check_folder, read_table
from vinl.benchmark.table import TableRow
from vinl.chain.records import Results
from vinl.config.errors import InputError
from vinl.config.fields import closest
from vinl.render.video import name_film


@dataclass(frozen=True, eq=False)
class Gathered:
    """The rows of all folders.

    Attributes:
        rows: at least one.
        is_table: whether a table is to be drawn.
        reference: row that the others are compared with.
        left_out: rows that no folder has, and why.
        command: that walked the rows, or that puts rows of different commands together.
    """

    rows: list[TableRow]
    is_table: bool
    reference: str
    left_out: dict[str, str] = field(default_factory=dict)
    command: list[str] = field(default_factory=list)


def gather_folders(folders: Sequence[Path], out: Path, reference: str | None = None) -> Gathered:
    """Read folders and put together what belongs together.

    Args:
        folders: of ``vinl eval``, with or without ``--table``.
        out: where the report goes; films that lie there are linked.
        reference: row that the others are compared with.

    Raises:
        InputError: no folder, a folder of something else, or folders that do not fit together.
    """
    try:
        return _gather(folders, out, reference)
    except (KeyError, TypeError, IndexError, AttributeError, OverflowError) as error:
        raise InputError(f"{_name_all(folders)}: an entry is missing or of the wrong kind ({error!r})") from error
    except ValueError as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"{_name_all(folders)}: a value is broken ({error})") from error


def _name_all(folders: Sequence[Path]) -> str:
    """The files that are read, of all folders."""
    return f"{RUN_FILE} and {EPISODES_FILE} in {', '.join(map(str, folders))}"


def _gather(folders: Sequence[Path], out: Path, reference: str | None) -> Gathered:
    if not folders:
        raise InputError("vinl report needs at least one folder of vinl eval")
    if len({folder.resolve() for folder in folders}) < len(folders):
        raise InputError("vinl report: a folder is given twice; give each once")
    titles: dict[Path, tuple[str, dict[str, Any]]] = {}
    tables, parts = [], []
    for folder in folders:
        if (folder / TABLE_FILE).exists():
            table = read_table(folder)
            tables.append(table)
            for name, row in table["rows"].items():
                if name not in table["left_out"]:
                    titles[folder / name] = name, row
                    parts.append(read_part(folder / name))
        else:
            parts.append(read_part(folder))
    groups = group_parts(parts)
    is_table = bool(tables) or len(groups) > 1
    rows: list[TableRow] = []
    for group in groups:
        known = next((titles[part.folder] for part in group if part.folder in titles), None)
        name, row = known or (_name_row(group[0], [row.name for row in rows]), {})
        results = merge_parts(group)
        results = replace(results, videos=_find_films(results, out / name if is_table else out))
        command = tuple(group[0].about["command"])
        rows.append(TableRow(name, row.get("title", name), results, row.get("paper"), command))
    if len(folders) > 1 or is_table != bool(tables):
        check_folder(out, is_table)
    names = [row.name for row in rows]
    if len(set(names)) < len(names):
        twice = next(name for name in names if names.count(name) > 1)
        raise InputError(
            f"row {twice!r} was walked by different policies in these folders; give tables of the same ones"
        )
    if reference is not None and reference not in names:
        raise InputError(f"--reference: there is no row {reference!r}{closest(reference, names)}; {', '.join(names)}")
    first = tables[0] if tables else {"reference": names[0], "left_out": {}}
    chosen = reference or (first["reference"] if first["reference"] in names else names[0])
    left_out = {name: why for table in tables for name, why in table["left_out"].items() if name not in names}
    same = len({tuple(row.command) for row in rows}) == 1
    command = list(rows[0].command) if same else ["vinl", "report", *map(str, folders)]
    return Gathered(rows, is_table, chosen, left_out, command)


def _name_row(part: Part, taken: Sequence[str]) -> str:
    """A name of letters, digits and dashes from who walked through what."""
    policies = part.about["policies"]
    words = (
        policies["locomotion"]["name"],
        policies["navigation"]["name"],
        part.about["config"]["obstacles"]["preset"],
    )
    name = "-".join("".join(c if c.isalnum() else "_" for c in word.lower()) for word in words)
    count = sum(other == name or other.startswith(f"{name}-") for other in taken)
    return f"{name}-{count + 1}" if count else name


def _find_films(results: Results, folder: Path) -> list[str]:
    names = [name_film(*record.key) for record in results.records]
    return [name for name in names if (folder / name).exists()]
