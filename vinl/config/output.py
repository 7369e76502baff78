"""What a command leaves behind: the folder it may write to, files that are written whole or not at all."""

from __future__ import annotations

import contextlib
import json
import numbers
import os
import platform
import shlex
import tempfile
from collections.abc import Iterator, Sequence
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import IO, Any

from vinl.config.errors import InputError

SCHEMA = 1
"""Version of ``results.json``. Names stay; new ones may be added without a new version."""

_IDLE, _IDLE_FLAGS = ("--out", "--workers", "--cluster"), ("--fresh", "--record")
"""Options, with a value and without, that are left out of the command."""


def strip_command(argv: Sequence[str]) -> list[str]:
    """A command line without what no figure depends on."""
    kept: list[str] = []
    words = iter(argv)
    for word in words:
        if word in _IDLE:
            next(words, None)
        elif word not in _IDLE_FLAGS and word.split("=")[0] not in _IDLE:
            kept.append(word)
    return kept


def check_named(out: str | Path, what: str = "folder") -> Path:
    """The folder, or whatever is written, if it has a name: without one, ``Path`` would take it for the current folder.

    Raises:
        InputError: it has none.
    """
    if not str(out).strip():
        raise InputError(f"--out is empty; give the name of a {what}")
    return Path(out)


def check_out(out: str | Path) -> Path:
    """The folder to write to, which need not exist yet.

    Raises:
        InputError: it has no name, it or a folder above it is a file, or nothing can be written there.
    """
    out = check_named(out)
    try:
        for path in (out, *out.parents):
            if path.is_dir():
                if not os.access(path, os.W_OK):
                    raise InputError(f"--out {out}: {path} may not be written to; choose another folder")
                with tempfile.TemporaryDirectory(prefix=".vinl-", dir=path):  # some places only pretend, such as /proc
                    return out
            if path.exists():
                raise InputError(f"--out {out}: {path} is a file; choose another folder")
    except OSError as error:
        raise InputError(
            f"--out {out}: nothing can be written there ({error.strerror}); choose another folder"
        ) from None
    return out


def choose_out(given: str | None, default: Path, command: Sequence[str]) -> Path:
    """The folder for the results of a command: the one given, or the first of ``default``, ``default-2`` and so on that
    does not hold those of another.

    Raises:
        InputError: the one given does, or nothing can be written there.
    """
    if given is not None:
        out = check_out(given)
        if (before := _read_command(out)) not in (None, list(command)):
            raise InputError(f"--out {out} holds the results of {shlex.join(before)!r}; choose another folder")
        return out
    out, number = default, 1
    while _read_command(out) not in (None, list(command)):
        number += 1
        out = default.with_name(f"{default.name}-{number}")
    return check_out(out)


def _read_command(out: Path) -> list[str] | None:
    """Of the results in a folder; None where there are none, or none that can be read."""
    try:
        return [str(word) for word in json.loads((out / "results.json").read_text(encoding="utf-8"))["command"]]
    except (OSError, ValueError, KeyError, TypeError):
        return None


def round_numbers(value: Any) -> Any:
    """Plain data with all floating point numbers to six digits after the point; tuples become lists."""
    if isinstance(value, dict):
        return {key: round_numbers(v) for key, v in value.items()}
    if isinstance(value, (list, tuple)):
        return [round_numbers(v) for v in value]
    is_float = isinstance(value, numbers.Real) and not isinstance(value, numbers.Integral)  # numpy's too
    return round(float(value), 6) if is_float else value


@contextlib.contextmanager
def write_whole(path: Path) -> Iterator[IO[bytes]]:
    """A file to write to that takes the place of an older one at the end of the context, whole or not at all.

    Raises:
        OSError: it cannot be written; it names the file.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, scratch = tempfile.mkstemp(prefix=f".{path.name}-", dir=path.parent)
    try:
        with os.fdopen(handle, "wb") as file:
            yield file
            file.flush()
            os.fsync(handle)
        Path(scratch).chmod(0o644)
        Path(scratch).replace(path)
    except OSError as error:
        raise OSError(error.errno, error.strerror, str(path)) from None
    finally:
        Path(scratch).unlink(missing_ok=True)


def write_text(path: Path, text: str) -> None:
    """Write a file whole or not at all; an older one is replaced."""
    with write_whole(path) as file:
        file.write(text.encode())


def write_json(path: Path, data: dict[str, Any]) -> None:
    """Write JSON; one episode a line, so that a person can read it and two runs can be compared line by line."""
    body = []
    for key, value in data.items():
        if key in ("episodes", "robots", "crossings") and isinstance(value, list):
            rows = ",\n".join("    " + json.dumps(row, allow_nan=False) for row in value)
            body.append(f'  "{key}": [\n{rows}\n  ]')
        else:
            text = json.dumps(value, indent=2, allow_nan=False).replace("\n", "\n  ")
            body.append(f'  "{key}": {text}')
    write_text(path, "{\n" + ",\n".join(body) + "\n}\n")


_PACKAGES = ("vinl", "mujoco", "numpy", "scipy", "shapely", "torch", "warp-lang")


def describe_environment() -> dict[str, str]:
    """Versions that figures may depend on."""
    return {
        "python": platform.python_version(),
        "machine": f"{platform.system()} {platform.machine()}",
        **list_packages(),
    }


def list_packages() -> dict[str, str]:
    """Versions of the packages that figures may depend on."""
    found = {}
    for name in _PACKAGES:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            continue
    return found
