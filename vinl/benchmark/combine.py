"""What lies in folders of ``vinl eval``, read again: one row, or rows side by side in a table."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, field
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
from vinl.benchmark.outputs import TABLE_FILE, check_folder, read_table
from vinl.benchmark.table import TableRow
from vinl.benchmark.work import list_keys
from vinl.chain.config import EvaluationConfig
from vinl.chain.records import Results
from vinl.config.errors import InputError
from vinl.config.fields import closest
from vinl.config.loader import build_config
from vinl.render.video import name_film


@dataclass(frozen=True, eq=False)
class Combined:
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


def read_folders(folders: Sequence[Path], out: Path, reference: str | None = None) -> Combined:
    """Read folders whose episodes are the same.

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


def _read_folders(folders: Sequence[Path], out: Path, reference: str | None) -> Combined:
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
    return Combined(rows, is_table, chosen, left_out, command)


def read_results(folder: Path, about: dict[str, Any], out: Path) -> Results:
    """One row as it was walked.

    Args:
        folder: that it lies in.
        about: what its ``run.json`` says.
        out: where films may lie.

    Raises:
        InputError: episodes are missing.
    """
    plans, seeds = read_plans(folder, about), about["config"]["seeds"]
    wanted = list_keys(plans, about["config"]["episodes_per_plan"], range(seeds[0], seeds[-1] + 1))
    done = {episode.record.key: episode for episode in read_episodes(folder)}
    missing = [key for key in wanted if key not in done]
    if missing:
        plan, seed, episode = missing[0]
        raise InputError(
            f"{folder}: {len(missing)} of {len(wanted)} episodes are missing, the first is episode {episode} of seed "
            f"{seed} in {plan}: the run was interrupted, start its command again"
        )
    config = build_config(EvaluationConfig, about["config"]["evaluation"], source=str(folder / RUN_FILE))
    episodes = [done[key] for key in wanted]
    aggregate = aggregate_episodes([e.record for e in episodes], config.min_metres)
    films = [name for key in wanted if (out / (name := name_film(*key))).exists()]
    wall = read_wall_seconds(folder)
    return Results(episodes, aggregate, plans, about["policies"], about["config"], wall, films)


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
