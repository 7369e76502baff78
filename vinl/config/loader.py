"""YAML files and dotted overrides to frozen, validated dataclasses, and back."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar

import dacite

from vinl.config.errors import InputError
from vinl.config.fields import closest, conform, field_type, inner_dataclass
from vinl.config.paths import configs_dir
from vinl.config.yaml_text import parse_override_value, read_yaml

T = TypeVar("T")

_WORDS = {int: "a whole number", float: "a number", bool: "true or false", str: "text"}
"""Types as people call them."""


def load_config(cls: type[T], name_or_path: str | Path, overrides: Sequence[str] = ()) -> T:
    """A configuration from a YAML file and overrides.

    A file may begin with ``extends: other`` (a file beside it, or a bare name); it then holds only what differs. A
    group of values in it may too, ``sensors: {extends: sensors/realistic, noise: 0.0}``.

    Args:
        cls: frozen dataclass to build; nested dataclasses are built from nested mappings.
        name_or_path: bare name of a shipped config (``"loco/rough"``) or path of a ``.yaml`` file.
        overrides: ``"ppo.epochs=3"``, applied in order after the file; values are read by the field's type. A whole
            group can be taken from a config: ``"sensors=sensors/ideal"``.

    Raises:
        InputError: missing or broken file, unknown key, wrong type, or a value that the dataclass refuses.
    """
    return build_config(cls, read_config(name_or_path), overrides, source=str(find_config(name_or_path)))


def read_config(name_or_path: str | Path) -> dict[str, Any]:
    """What a config file and those that it extends say together, as plain data, not yet checked against a dataclass.

    Raises:
        InputError: missing or broken file.
    """
    return _read(find_config(name_or_path), ())


def build_config(cls: type[T], data: Mapping[str, Any], overrides: Sequence[str] = (), source: str = "config") -> T:
    """A configuration from plain data, such as ``dump_config`` returns; ``source`` names it in errors, or the override
    without which it would be right."""
    try:
        return _build(cls, data, overrides, source)
    except InputError:
        for k in range(len(overrides)):
            try:
                _build(cls, data, overrides[:k], source)
            except InputError:
                break  # wrong before this override
            _build(cls, data, overrides[: k + 1], source=overrides[k])
        raise


def _build(cls: type[T], data: Mapping[str, Any], overrides: Sequence[str], source: str) -> T:
    merged = _merge({}, data)
    for override in overrides:
        _apply(cls, merged, override)
    merged = conform(cls, merged, source)
    try:
        return dacite.from_dict(cls, merged, dacite.Config(strict=True, cast=[Path]))
    except dacite.MissingValueError as error:
        raise InputError(f"{source}: {error.field_path} is missing; add it") from None
    except dacite.WrongTypeError as error:
        kind = error.field_type
        wanted = _WORDS.get(kind) or (kind.__name__ if isinstance(kind, type) else str(kind).replace("typing.", ""))
        raise InputError(f"{source}: {error.field_path} must be {wanted}, got {error.value!r}") from None
    except InputError as error:
        raise InputError(f"{source}: {error}") from None
    except (dacite.DaciteError, ValueError, TypeError) as error:
        raise InputError(f"{source}: {error}") from None


def dump_config(config: Any) -> dict[str, Any]:
    """A configuration as plain data (mappings, lists, numbers, text), which ``build_config`` turns back into it."""
    return _plain(dataclasses.asdict(config))


def find_config(name_or_path: str | Path, beside: Path | None = None) -> Path:
    """The file that a bare name or a path means; ``beside`` is a folder to look in first.

    Raises:
        InputError: there is no such file; the message lists what there is.
    """
    text = str(name_or_path)
    is_path = text.endswith((".yaml", ".yml"))
    name = text if is_path else f"{text}.yaml"
    shipped = [configs_dir() / name] if not is_path else []
    candidates = ([beside / name] if beside else []) + shipped + ([Path(text)] if is_path else [])
    for candidate in candidates:
        if candidate.is_file():
            return candidate
    if is_path:
        folder = Path(text).parent
        there = sorted(p.name for p in folder.glob("*.y*ml")) if folder.is_dir() else []
        found = f"{folder} holds {', '.join(there)}" if there else f"there is no YAML file in {folder}"
        raise InputError(f"config {text} does not exist; {found}")
    names = list_configs()
    raise InputError(f"unknown config {text!r}{closest(text, names)}; known: {', '.join(names) or 'none'}")


def list_configs() -> list[str]:
    """Bare names of the shipped configs."""
    root = configs_dir()
    return sorted(str(p.relative_to(root).with_suffix("")) for p in root.rglob("*.yaml"))


def _read(path: Path, inherited_by: tuple[Path, ...]) -> dict[str, Any]:
    resolved = path.resolve()
    if resolved in inherited_by:
        chain = " -> ".join(p.name for p in (*inherited_by, resolved))
        raise InputError(f"{path}: extends itself ({chain}); remove one of the links")
    data = read_yaml(path)
    return _extend(data, path, (*inherited_by, resolved))


def _extend(data: Mapping[str, Any], path: Path, inherited_by: tuple[Path, ...]) -> dict[str, Any]:
    """A mapping of a file, merged with what it extends; so are the mappings in it."""
    inner = {
        key: _extend(value, path, inherited_by) if isinstance(value, Mapping) else value for key, value in data.items()
    }
    parent = inner.pop("extends", None)
    if parent is None:
        return inner
    if not isinstance(parent, str):
        raise InputError(f"{path}: extends must be the name of a config, got {parent!r}")
    return _merge(_read(find_config(parent, beside=path.parent), inherited_by), inner)


def _merge(base: Mapping[str, Any], top: Mapping[str, Any]) -> dict[str, Any]:
    """A new mapping; nested mappings are merged, everything else in ``top`` replaces ``base``."""
    merged = dict(base)
    for key, value in top.items():
        below = merged.get(key)
        if isinstance(value, Mapping):
            merged[key] = _merge(below if isinstance(below, Mapping) else {}, value)
        else:
            merged[key] = value
    return merged


def _apply(cls: Any, data: dict[str, Any], override: str) -> None:
    dotted, equals, text = override.partition("=")
    keys = dotted.strip().split(".")
    if not equals or not all(keys):
        raise InputError(f"override {override!r} is not of the form key.subkey=value")
    kind: Any = cls
    for depth, key in enumerate(keys):
        kind = field_type(kind, key, ".".join(keys[:depth]), f"override {override!r}")
        if depth == len(keys) - 1:
            if inner_dataclass(kind) is not None and not text.lstrip().startswith("{") and text != "null":
                if not _names_config(text):
                    raise InputError(
                        f"override {override!r}: {dotted} is a group of values; set one of them, or name a config"
                    )
                data[key] = read_config(text)
                continue
            data[key] = parse_override_value(text, kind, override)
        else:
            below = data.get(key)
            data[key] = dict(below) if isinstance(below, Mapping) else {}
            data = data[key]


def _names_config(text: str) -> bool:
    return text.endswith((".yaml", ".yml")) or text in list_configs()


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, (tuple, list)):
        return [_plain(item) for item in value]
    return str(value) if isinstance(value, Path) else value
