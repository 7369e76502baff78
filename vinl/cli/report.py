"""``vinl report``: the report of folders of ``vinl eval`` drawn again, several side by side."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from vinl.cli.options import parse_options


@dataclass(frozen=True)
class Options:
    """Draw the report of a folder of vinl eval again, or of several folders side by side as a table: results.json and
    report.html. Nothing is walked."""

    folders: Annotated[tuple[str, ...], tyro.conf.Positional]
    """Folders that vinl eval wrote."""
    out: str | None = None
    """Folder for results.json and report.html (default: of one folder that folder, of several runs/report)."""
    reference: str | None = None
    """Row of a table that the others are compared with."""


def main(argv: list[str]) -> int:
    """Read, write, print."""
    options = parse_options(Options, argv, "report")
    from rich.console import Console

    from vinl.benchmark.folders import read_folders, write_run, write_table
    from vinl.benchmark.report import print_summary, print_table
    from vinl.config.output import check_out

    default = options.folders[0] if len(options.folders) == 1 else "runs/report"
    out = check_out(default if options.out is None else options.out)
    console = Console()
    table, is_table = read_folders([Path(folder) for folder in options.folders], out, options.reference)
    if is_table:
        print_table(console, write_table(out, table), out)
    else:
        write_run(out, table.rows[0].results, table.command)
        print_summary(console, table.rows[0].results, out)
    return 0
