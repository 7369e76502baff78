"""Names of many plans in one file: ``houses.jsonl.gz:0-49``."""

from __future__ import annotations

import re
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path

from vinl.config.errors import InputError
from vinl.world.readers.json_plan import count_plans

_RANGE = re.compile(r"^(?P<file>.+?):(?P<first>\d+)-(?P<last>\d*)(?:/(?P<step>\d+))?$")
_SLICE = re.compile(r"^(?P<file>.+?):(?P<first>\d+):(?P<end>\d+)(?::(?P<step>\d+))?$")


def expand_paths(paths: Sequence[str]) -> list[str]:
    """The plans that paths name, one by one.

    ``FILE:0-49`` are the first fifty plans of a JSON file, ``FILE:50-`` those from number 50 to the end, ``FILE:0-/2``
    every second one; ``FILE:1:199:2`` is every second one from 1 to below 199. Other paths stay as they are.

    Raises:
        InputError: a file is missing, or has no such plans.
    """
    return [plan for path in paths for plan in _expand(str(path))]


def _expand(path: str) -> list[str]:
    if Path(path).exists():
        return [path]
    match = _RANGE.match(path) or _SLICE.match(path)
    if match is None:
        return [path]
    found = match.groupdict()
    file, first, step = found["file"], int(found["first"]), int(found.get("step") or 1)
    count = _count(file)
    last = int(found["last"]) + 1 if found.get("last") else count
    end = int(found.get("end") or last)
    if step < 1 or end <= first:
        raise InputError(f"{path}: names no plan; write FILE:FIRST-LAST, with numbers from 0 on")
    if end > count:
        raise InputError(f"{path}: {file} holds {count} plans, 0 to {count - 1}")
    return [f"{file}:{k}" for k in range(first, end, step)]


@lru_cache(maxsize=64)
def _count(file: str) -> int:
    if not Path(file).is_file():
        raise InputError(f"{file}: no such file")
    return count_plans(Path(file))
