"""Folders of ``vinl eval`` put together: shares of the same row, and rows of the same table."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from vinl.benchmark.journal import (
    RUN_FILE,
    describe_differences,
    read_about,
    read_episodes,
    read_plans,
    read_wall_seconds,
)
from vinl.benchmark.metrics import aggregate_episodes
from vinl.benchmark.shard import Shard
from vinl.benchmark.work import list_keys
from vinl.chain.config import EvaluationConfig
from vinl.chain.records import Episode, Key, Results
from vinl.config.errors import InputError
from vinl.config.loader import build_config

TABLE_FILE = "table.json"


@dataclass(frozen=True, eq=False)
class Part:
    """A folder with episodes of one row: what ``run.json`` says, and where."""

    folder: Path
    about: dict[str, Any]

    @property
    def row(self) -> str:
        """What tells rows apart: who walks, through what clutter."""
        return json.dumps([self.about["policies"], self.about["config"]["obstacles"]], sort_keys=True)

    @property
    def rules(self) -> dict[str, Any]:
        """What all parts of a table must agree on."""
        config = {key: value for key, value in self.about["config"].items() if key != "obstacles"}
        plans = [{k: plan[k] for k in ("name", "sha256")} for plan in self.about["plans"]]
        return {"config": config, "plans": plans, "packages": self.about["packages"]}


def read_part(folder: Path) -> Part:
    """A folder of ``vinl eval``.

    Raises:
        InputError: it is not one.
    """
    if (folder / TABLE_FILE).exists():
        raise InputError(f"{folder} holds a whole table; give tables only beside tables of the same rows")
    return Part(folder, read_about(folder))


def group_parts(parts: Sequence[Part]) -> list[list[Part]]:
    """The parts of each row, rows in the order in which they first occur.

    Raises:
        InputError: two parts follow other rules, or lie in other floor plans.
    """
    groups: dict[str, list[Part]] = {}
    for part in parts:
        first = parts[0]
        differences = describe_differences(first.rules, part.rules, (f"in {first.folder}", f"in {part.folder}"))
        if differences:
            raise InputError(f"{first.folder} and {part.folder} do not belong together: {differences}")
        groups.setdefault(part.row, []).append(part)
    return list(groups.values())


def merge_parts(parts: Sequence[Part]) -> Results:
    """One row from its shares.

    Raises:
        InputError: an episode is in two folders, or in none.
    """
    about = parts[0].about
    plans = read_plans(parts[0].folder, about)
    seeds = about["config"]["seeds"]
    wanted = list_keys(plans, about["config"]["episodes_per_plan"], range(seeds[0], seeds[-1] + 1))
    done: dict[Key, Episode] = {}
    found: dict[Key, Path] = {}
    for part in parts:
        for episode in read_episodes(part.folder):
            key = episode.record.key
            if key in found and found[key] != part.folder:
                raise InputError(f"{found[key]} and {part.folder} both hold {_name(key)}; give each share once")
            found[key], done[key] = part.folder, episode
    lost = [key for key in wanted if key not in done]
    if lost:
        shares = ", ".join(sorted({part.about["shard"] for part in parts}, key=lambda text: text.split("/")))
        raise InputError(
            f"{', '.join(str(part.folder) for part in parts)}: {len(lost)} of {len(wanted)} episodes are missing, the "
            f"first is {_name(lost[0])}; there are shares {shares}: {_advise(parts, set(lost))}"
        )
    config = build_config(EvaluationConfig, about["config"]["evaluation"], source=str(parts[0].folder / RUN_FILE))
    episodes = [done[key] for key in wanted]
    aggregate = aggregate_episodes([e.record for e in episodes], config.min_metres)
    wall = sum(read_wall_seconds(part.folder) for part in parts)
    return Results(episodes, aggregate, plans, about["policies"], about["config"], wall)


def _advise(parts: Sequence[Part], lost: set[Key]) -> str:
    """Which command brings the missing episodes."""
    shares = [Shard.parse(part.about["shard"]) for part in parts]
    count = shares[0].count
    if any(share.count != count for share in shares):
        return "all must be shares of the same number"
    absent = sorted(set(range(1, count + 1)) - {share.index for share in shares})
    if absent:
        return f"give the folder of --shard {absent[0]}/{count} too"
    return "a run was interrupted: start its command again"


def _name(key: Key) -> str:
    plan, seed, episode = key
    return f"episode {episode} of seed {seed} in {plan}"
