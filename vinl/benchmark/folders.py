"""The folders of ``vinl eval``: the files that a run or a table ends with, and rows read again for a report."""

from __future__ import annotations

import json
import shlex
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from itertools import islice
from pathlib import Path
from typing import Any

from vinl.benchmark.journal import (
    EPISODES_FILE,
    RUN_FILE,
    describe_differences,
    read_about,
    read_episodes,
    read_plans,
    read_wall_seconds,
)
from vinl.benchmark.metrics import aggregate_episodes
from vinl.benchmark.protocol import each_key
from vinl.benchmark.report import render_report, render_table_report
from vinl.benchmark.table import PaperFigures, RowConfig, Table, TableConfig, TableRow, summarise_table
from vinl.chain.config import EvaluationConfig
from vinl.chain.records import Results, plain_record
from vinl.config.errors import InputError
from vinl.config.loader import build_config, closest
from vinl.config.output import SCHEMA, describe_environment, write_json, write_text
from vinl.render.video import name_film

RESULTS_FILE, REPORT_FILE, TABLE_FILE = "results.json", "report.html", "table.json"


def write_run(out: Path, results: Results, command: Sequence[str]) -> None:
    """``results.json`` and ``report.html`` of one row."""
    write_json(out / RESULTS_FILE, results_as_dict(results, command))
    write_text(out / REPORT_FILE, render_report(results, shlex.join(command)))


def write_table(out: Path, table: Table) -> dict[str, Any]:
    """The files of every row in its folder, and the table's beside them.

    Returns:
        What the table's ``results.json`` holds.
    """
    for row in table.rows:
        write_run(out / row.name, row.results, row.command or table.command)
    data = summarise_table(table)
    write_json(out / RESULTS_FILE, data)
    write_text(out / REPORT_FILE, render_table_report(data))
    return data


def results_as_dict(results: Results, command: Sequence[str]) -> dict[str, Any]:
    """Results as plain data. Two runs with the same seed differ in ``timing`` and ``aggregate.wall_seconds`` only."""
    records = results.records
    min_metres = results.config["evaluation"]["min_metres"]
    plans = [
        {
            "name": plan.name,
            "source": plan.source,
            "area_m2": round(plan.area_m2, 2),
            "aggregate": aggregate_episodes([r for r in records if r.plan == plan.name], min_metres),
        }
        for plan in results.plans
    ]
    wall = round(results.wall_seconds, 2)
    return {
        "schema": SCHEMA,
        "command": list(command),
        "config": results.config,
        "policies": results.policies,
        "environment": describe_environment(),
        "plans": plans,
        "aggregate": {**results.aggregate, "wall_seconds": wall},
        "episodes": [plain_record(r) for r in records],
        "timing": {"wall_seconds": wall, "workers": results.workers},
    }


def keep_table(out: Path, table: TableConfig, left_out: Mapping[str, str], command: Sequence[str]) -> None:
    """Say in the folder which rows there are, so that the report can be drawn again."""
    rows = {name: {"title": row.title, "paper": row.paper and asdict(row.paper)} for name, row in table.rows.items()}
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


def read_folders(folders: Sequence[Path], out: Path, reference: str | None = None) -> tuple[Table, bool]:
    """Rows of folders whose episodes are the same, and whether they make a table: one robot's folder does not.

    Args:
        folders: of ``vinl eval``, with or without ``--table``.
        out: where the report goes; films that lie there are linked.
        reference: row that the others are compared with.

    Raises:
        InputError: no folder, a folder of something else, or folders that do not fit together.
    """
    try:
        return _read_folders(folders, out, reference)
    except InputError:
        raise
    except (KeyError, TypeError, IndexError, AttributeError, OverflowError, ValueError) as error:
        raise InputError(
            f"{RUN_FILE} and {EPISODES_FILE} in {', '.join(map(str, folders))}: an entry is missing, broken or of the "
            f"wrong kind ({error!r})"
        ) from error


def _read_folders(folders: Sequence[Path], out: Path, reference: str | None) -> tuple[Table, bool]:
    if not folders:
        raise InputError("vinl report needs at least one folder of vinl eval")
    if len({folder.resolve() for folder in folders}) < len(folders):
        raise InputError("vinl report: a folder is given twice; give each once")
    tables = {folder: read_table(folder) for folder in folders if (folder / TABLE_FILE).exists()}
    walked: dict[Path, dict[str, Any]] = {}  # folder of each row, and its name, title and figures of the paper
    for folder in folders:
        if folder not in tables:
            walked[folder] = {}
            continue
        rows = tables[folder]["rows"]
        walked |= {folder / n: {"name": n, **row} for n, row in rows.items() if n not in tables[folder]["left_out"]}
    abouts = {folder: read_about(folder) for folder in walked}
    _check_rules(abouts)
    is_table = bool(tables) or len(walked) > 1
    rows = []
    for folder, known in walked.items():
        name = known.get("name") or _name_row(abouts[folder], [row.name for row in rows])
        results = read_results(folder, abouts[folder], out / name if is_table else out)
        command = tuple(abouts[folder]["command"])
        rows.append(TableRow(name, known.get("title", name), results, known.get("paper"), command))
    if len(folders) > 1:
        check_folder(out, is_table)
    names = [row.name for row in rows]
    if len(set(names)) < len(names):
        twice = next(name for name in names if names.count(name) > 1)
        raise InputError(f"row {twice!r} is in two of these folders; give tables of different rows")
    if reference is not None and reference not in names:
        raise InputError(f"--reference: there is no row {reference!r}{closest(reference, names)}; {', '.join(names)}")
    first = next(iter(tables.values()), {"reference": names[0]})
    chosen = reference or (first["reference"] if first["reference"] in names else names[0])
    left_out = {n: why for table in tables.values() for n, why in table["left_out"].items() if n not in names}
    same = len({tuple(row.command) for row in rows}) == 1
    command = list(rows[0].command) if same else ["vinl", "report", *map(str, folders)]
    return Table(rows, chosen, left_out, command), is_table


def read_results(folder: Path, about: dict[str, Any], out: Path) -> Results:
    """One row as it was walked.

    Args:
        about: what its ``run.json`` says.
        out: where films may lie.

    Raises:
        InputError: episodes are missing.
    """
    plans, config = read_plans(folder, about), about["config"]
    seeds = range(config["seeds"][0], config["seeds"][-1] + 1)
    done = {episode.record.key: episode for episode in read_episodes(folder)}
    # a damaged run.json may ask for millions: no more are looked for than there are
    wanted = list(islice(each_key(plans, config["episodes_per_plan"], seeds), len(done) + 1))
    lost = next((key for key in wanted if key not in done), None)
    if lost is not None:
        total = len(plans) * len(seeds) * config["episodes_per_plan"]
        plan, seed, episode = lost
        raise InputError(
            f"{folder}: {total - len(done)} of {total} episodes are missing, the first is episode {episode} of seed "
            f"{seed} in {plan}: the run was interrupted, start its command again"
        )
    rules = build_config(EvaluationConfig, config["evaluation"], source=str(folder / RUN_FILE))
    episodes = [done[key] for key in wanted]
    aggregate = aggregate_episodes([e.record for e in episodes], rules.min_metres)
    films = [name for key in wanted if (out / (name := name_film(*key))).exists()]
    wall = read_wall_seconds(folder)
    return Results(episodes, aggregate, plans, about["policies"], config, wall, films)


def _check_rules(abouts: dict[Path, dict[str, Any]]) -> None:
    """Refuse rows that follow other rules, lie in other floor plans or are the same twice."""
    (first, there), *others = abouts.items()
    seen = {_describe_row(there): first}
    for folder, about in others:
        differences = describe_differences(_list_rules(there), _list_rules(about), (f"in {first}", f"in {folder}"))
        if differences:
            raise InputError(f"{first} and {folder} do not belong together: {differences}")
        twin = seen.setdefault(_describe_row(about), folder)
        if twin != folder:
            raise InputError(f"{twin} and {folder} hold the same robot in the same clutter; give one of them")


def _describe_row(about: dict[str, Any]) -> str:
    """What tells rows apart: who walks, through what clutter."""
    return json.dumps([about["policies"], about["config"]["obstacles"]], sort_keys=True)


def _list_rules(about: dict[str, Any]) -> dict[str, Any]:
    """What all rows of a table must agree on."""
    config = {key: value for key, value in about["config"].items() if key != "obstacles"}
    plans = [{k: plan[k] for k in ("name", "sha256")} for plan in about["plans"]]
    return {"config": config, "plans": plans, "packages": about["packages"]}


def _name_row(about: dict[str, Any], taken: Sequence[str]) -> str:
    """A name of letters, digits and dashes from who walked through what."""
    policies = about["policies"]
    words = (policies["locomotion"]["name"], policies["navigation"]["name"], about["config"]["obstacles"]["preset"])
    name = "-".join("".join(c if c.isalnum() else "_" for c in word.lower()) for word in words)
    count = sum(other == name or other.startswith(f"{name}-") for other in taken)
    return f"{name}-{count + 1}" if count else name
