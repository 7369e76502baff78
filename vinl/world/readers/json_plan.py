"""JSON files of floor plans: one plan, a list of plans, or one plan a line; plain or gzip."""

from __future__ import annotations

import gzip
import json
import re
import zlib
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any

from vinl.config.errors import InputError
from vinl.world.floorplan import FloorPlan
from vinl.world.readers.houseexpo import build_houseexpo_plan, is_houseexpo
from vinl.world.readers.own import BOXES_SCHEMA, SCHEMA, build_boxes_plan, build_own_plan
from vinl.world.readers.procthor import build_procthor_plan
from vinl.world.readers.vectors import build_vector_plan, is_vector_plan
from vinl.world.start_goal import check_way

_SMALL = 20_000_000
"""Files up to this size are read once [bytes]."""


def read_json_plan(
    file: Path, index: int | None, resolution: float | None = None, wall_height: float = 2.5
) -> FloorPlan:
    """Read plan number ``index`` (from 0 on; the first if ``None``) of a file; other arguments as of
    ``load_floorplan``.

    What is in it tells the format: our own two by their ``schema``, HouseExpo by ``verts``, vectors by walls of four
    numbers, ProcTHOR otherwise. Raises ``InputError`` if the file is broken, holds no such plan, or the plan has no
    floor for the robot.
    """
    bare, k = file.name.lower().removesuffix(".gz"), index or 0
    plans, as_lines = _read_plans(file), bare.endswith(".jsonl")
    if not 0 <= k < len(plans):
        raise InputError(f"{file}:{k}: no plan with this number; they go from 0 to {len(plans) - 1}")
    house = _parse(plans[k], f"{file}:{k}") if as_lines else plans[k]
    if not isinstance(house, dict):
        raise InputError(f"{file}: not a floor plan; a JSON object with 'rooms' and 'walls' is needed")
    stem = file.name[: -len(".jsonl.gz")] if as_lines and file.name.lower().endswith(".gz") else Path(bare).stem
    several = index is not None or len(plans) > 1
    name, source = (f"{stem}:{k}", f"{file}:{k}") if several else (stem, str(file))
    try:
        if house.get("schema") is not None:
            if house["schema"] == BOXES_SCHEMA:
                return build_boxes_plan(house, name, source)
            if house["schema"] != SCHEMA:
                known = f"'{SCHEMA}' and '{BOXES_SCHEMA}'"
                raise InputError(f"{source}: unknown schema '{house['schema']}'; this version reads {known}")
            return build_own_plan(house, name, source)
        if is_houseexpo(house):
            return check_way(build_houseexpo_plan(house, name, source, resolution, wall_height))
        if is_vector_plan(house):
            return check_way(build_vector_plan(house, name, source, resolution, wall_height))
        if "rooms" not in house or "walls" not in house:
            raise InputError(
                f"{source}: not a floor plan; a ProcTHOR house has 'rooms' and 'walls', a HouseExpo file has 'verts'"
            )
        return build_procthor_plan(house, name, source, file.parent / "asset_bbox.json")
    except (KeyError, TypeError, IndexError, AttributeError, OverflowError) as error:
        raise InputError(f"{source}: the plan lacks an entry or has one of the wrong kind ({error!r})") from None
    except ValueError as error:
        if isinstance(error, InputError):
            raise error if str(file) in str(error) else InputError(f"{source}: {error}") from None
        raise InputError(f"{source}: the plan has a broken number ({error})") from None


def _read_plans(file: Path) -> list[Any]:
    """What a file holds: one plan, a list of plans, or lines that are not empty, each a plan's text."""
    try:
        if file.name.lower().removesuffix(".gz").endswith(".jsonl"):
            status = file.stat()
            read = _cache_lines if status.st_size < _SMALL else _cache_lines.__wrapped__
            plans: Any = read(file, status.st_mtime_ns)
        else:
            with _open_text(file) as stream:
                plans = _parse(stream.read(), str(file))
    except (OSError, EOFError, zlib.error, UnicodeDecodeError) as error:
        raise _explain(file, error) from None
    plans = plans if isinstance(plans, list) else [plans]
    if not plans:
        raise InputError(f"{file}: the file is empty; it should hold a floor plan")
    return plans


@lru_cache(maxsize=2)
def _cache_lines(file: Path, written: int) -> list[str]:
    with _open_text(file) as lines:
        return [line for line in lines if line.strip()]


def _open_text(file: Path):
    return (gzip.open if file.name.lower().endswith(".gz") else open)(file, "rt", encoding="utf-8")


def _explain(file: Path, error: Exception) -> InputError:
    if isinstance(error, EOFError | zlib.error):
        return InputError(f"{file}: the gzip file is cut off or damaged; fetch it again")
    if isinstance(error, gzip.BadGzipFile):
        return InputError(f"{file}: not a gzip file; name it .json or .jsonl if it is plain text")
    if isinstance(error, UnicodeDecodeError):
        return InputError(f"{file}: not a text file; JSON in UTF-8 is needed")
    return InputError(f"{file}: cannot be read ({error})")


def _parse(text: str, where: str) -> Any:
    try:
        return json.loads(text)
    except (ValueError, RecursionError) as error:  # ValueError: also a number of thousands of digits
        raise InputError(f"{where}: broken JSON ({error}); is the file complete?") from None


_RANGE = re.compile(r"^(?P<file>.+?):(?P<first>\d+)-(?P<last>\d*)(?:/(?P<step>\d+))?$")
_SLICE = re.compile(r"^(?P<file>.+?):(?P<first>\d+):(?P<end>\d+)(?::(?P<step>\d+))?$")


def expand_paths(paths: Sequence[str]) -> list[str]:
    """The plans that paths name, one by one. ``FILE:0-49`` are the first fifty plans of a JSON file, ``FILE:50-`` those
    from number 50 to the end, ``FILE:0-/2`` every second one; ``FILE:1:199:2`` is every second one from 1 to below 199.
    Other paths stay as they are. Raises ``InputError`` if a file is missing, or has no such plans."""
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
    if not file.lower().removesuffix(".gz").endswith((".json", ".jsonl")):
        raise InputError(f"{file}: only JSON files hold several plans")
    return len(_read_plans(Path(file)))
