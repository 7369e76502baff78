"""The files that an evaluation ends with: of one row, and of a table."""

from __future__ import annotations

import json
import shlex
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from vinl.benchmark.journal import RUN_FILE
from vinl.benchmark.report import write_report
from vinl.benchmark.results_file import results_as_dict
from vinl.benchmark.table import TableRow, summarise_table
from vinl.benchmark.table_config import PaperFigures, RowConfig, TableConfig
from vinl.benchmark.table_report import write_table_report
from vinl.chain.records import Results
from vinl.config.errors import InputError
from vinl.config.loader import build_config
from vinl.config.output import write_json

RESULTS_FILE, REPORT_FILE, TABLE_FILE = "results.json", "report.html", "table.json"


def write_run(out: Path, results: Results, command: Sequence[str]) -> None:
    """``results.json`` and ``report.html`` of one row."""
    write_json(out / RESULTS_FILE, results_as_dict(results, command))
    write_report(out / REPORT_FILE, results, shlex.join(command))


def write_table(
    out: Path,
    rows: Sequence[TableRow],
    reference: str,
    left_out: Mapping[str, str],
    command: Sequence[str],
) -> dict[str, Any]:
    """The files of every row in its folder, and the table's beside them.

    Returns:
        What the table's ``results.json`` holds.
    """
    for row in rows:
        write_run(out / row.name, row.results, row.command or command)
    data = summarise_table(rows, reference, left_out, command)
    write_json(out / RESULTS_FILE, data)
    write_table_report(out / REPORT_FILE, data)
    return data


def keep_table(out: Path, table: TableConfig, left_out: Mapping[str, str], command: Sequence[str]) -> None:
    """Say in the folder which rows there are, so that the report can be drawn again."""
    rows = {name: {"title": row.title, "paper": _plain(row.paper)} for name, row in table.rows.items()}
    about = {"command": list(command), "reference": table.reference, "rows": rows, "left_out": dict(left_out)}
    write_json(out / TABLE_FILE, {"schema": 1, **about})


def read_table(out: Path) -> dict[str, Any]:
    """What ``keep_table`` wrote; ``paper`` of each row as figures.

    Raises:
        InputError: the file is broken or of another version.
    """
    path = out / TABLE_FILE
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
        if data["schema"] != 1:
            raise KeyError("schema")
        for row in data["rows"].values():
            row["paper"] = None if row["paper"] is None else build_config(PaperFigures, row["paper"], source=str(path))
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise InputError(f"{path} cannot be read ({error}); start the evaluation of the table again") from None
    return data


def check_folder(out: Path, table: bool) -> None:
    """Refuse a folder that holds the other kind of evaluation.

    Raises:
        InputError: it does.
    """
    if table and (out / RUN_FILE).exists():
        raise InputError(f"--out {out} holds an evaluation of one robot; choose another folder for the table")
    if not table and (out / TABLE_FILE).exists():
        raise InputError(f"--out {out} holds a table; choose another folder")


def leave_out(table: TableConfig, strict: bool) -> tuple[dict[str, RowConfig], dict[str, str]]:
    """The rows that can be walked, and those that cannot, with the reason.

    Raises:
        InputError: none can, or with ``strict``, one cannot.
    """
    left_out = {name: row.missing for name, row in table.rows.items() if row.missing}
    if left_out and (strict or len(left_out) == len(table.rows)):
        name, why = next(iter(left_out.items()))
        more = f", and {len(left_out) - 1} more rows" if len(left_out) > 1 else ""
        raise InputError(
            f"row {name}: {why}{more}; give policy folders in a table of your own (--table-file), or --nav"
        )
    return {name: row for name, row in table.rows.items() if name not in left_out}, left_out


def _plain(paper: PaperFigures | None) -> dict[str, Any] | None:
    return None if paper is None else asdict(paper)
