"""YAML files and dotted overrides to frozen, validated dataclasses, and back."""

from __future__ import annotations

import contextlib
import dataclasses
import difflib
import re
import types
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar, Union, get_args, get_origin, get_type_hints

import dacite
import yaml

from vinl.config.errors import InputError
from vinl.config.paths import configs_dir


class _Loader(yaml.SafeLoader):
    """Plain data only; YAML 1.2's floats (1e-3 has no dot) and no repeated keys."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
        seen = set()
        for key_node, _ in node.value:
            key = self.construct_object(key_node, deep=True)
            if isinstance(key, (list, dict)):
                raise yaml.constructor.ConstructorError(None, None, "a key must be a word", key_node.start_mark)
            if key in seen:
                raise yaml.constructor.ConstructorError(None, None, f"{key!r} stands twice", key_node.start_mark)
            seen.add(key)
        return super().construct_mapping(node, deep)


_Loader.add_implicit_resolver(
    "tag:yaml.org,2002:float", re.compile(r"^[-+]?(?:[0-9][0-9_]*)(?:\.[0-9_]*)?[eE][-+]?[0-9]+$"), list("-+0123456789")
)


def read_yaml(path: Path) -> dict[str, Any]:
    """The mapping in a YAML file; an empty file is an empty mapping.

    Raises:
        InputError: the file cannot be read, is not YAML (with the line), or is not a mapping.
    """
    try:
        data = yaml.load(path.read_text(encoding="utf-8"), _Loader)
    except OSError as error:
        raise InputError(f"cannot read {path}: {error.strerror}") from None
    except UnicodeDecodeError:
        raise InputError(f"{path} is not a text file; expected YAML") from None
    except yaml.YAMLError as error:
        raise InputError(f"{path}{_place(error)} is not valid YAML: {_problem(error)}") from None
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path} is not valid YAML: {error}") from None
    if data is None:
        return {}
    if not isinstance(data, dict):
        raise InputError(f"{path} must hold keys and values (key: value), got {type(data).__name__}")
    return {str(key): value for key, value in data.items()}


def parse_override_value(text: str, kind: Any, override: str) -> Any:
    """The value of ``key=text`` for a field annotated ``kind``.

    Text stays text where the field wants it (``name=3``), a list may come without brackets (``sizes=64,32``).
    """
    wants = get_args(kind) if get_origin(kind) in (Union, types.UnionType) else (kind,)
    if str in wants and not (type(None) in wants and text.strip() in ("null", "~", "None")):
        return text
    origins = {get_origin(w) or w for w in wants}
    if origins & {tuple, list} and "," in text and not text.lstrip().startswith("["):
        text = f"[{text}]"
    if type(None) in wants and text.strip() == "None":
        return None
    try:
        return yaml.load(text, _Loader)
    except (yaml.YAMLError, ValueError) as error:
        problem = _problem(error) if isinstance(error, yaml.YAMLError) else str(error)
        raise InputError(f"override {override!r} has no readable value: {problem}") from None


def _place(error: yaml.YAMLError) -> str:
    mark = getattr(error, "problem_mark", None) or getattr(error, "context_mark", None)
    return f", line {mark.line + 1}," if mark else ""


def _problem(error: yaml.YAMLError) -> str:
    text = getattr(error, "problem", None) or str(error)
    return " ".join(str(text).split())


def closest(word: str, known: Iterable[str]) -> str:
    """``", did you mean 'x'?"``, or nothing if no known word is near."""
    near = difflib.get_close_matches(word, list(known), n=1, cutoff=0.6)
    return f", did you mean {near[0]!r}?" if near else ""


def inner_dataclass(kind: Any) -> Any | None:
    """The dataclass of an annotation: itself, or the one in ``X | None``; None if there is none."""
    if isinstance(kind, type) and dataclasses.is_dataclass(kind):
        return kind
    if get_origin(kind) in (Union, types.UnionType):
        inner = [c for c in get_args(kind) if isinstance(c, type) and dataclasses.is_dataclass(c)]
        return inner[0] if len(inner) == 1 else None
    return None


def field_type(kind: Any, key: str, prefix: str, source: str) -> Any:
    """Annotation of ``key`` in the dataclass or mapping type ``kind``; ``prefix`` is the dotted path to it.

    Raises:
        InputError: there is no such key.
    """
    cls = inner_dataclass(kind)
    if cls is None:
        if get_origin(kind) in (dict, Mapping):
            return get_args(kind)[1]
        if kind in (dict, Any):
            return Any
        raise InputError(f"{source}: {prefix} holds a single value, it has no {key!r}")
    names = [f.name for f in dataclasses.fields(cls) if f.init]
    if key not in names:
        where = f"{prefix}.{key}" if prefix else key
        raise InputError(f"{source}: unknown key {where!r}{closest(key, names)}; known: {', '.join(names)}")
    return get_type_hints(cls)[key]


def conform(kind: Any, value: Any, source: str, prefix: str = "") -> Any:
    """The value as the annotation wants it where no meaning is lost: lists to tuples, whole numbers to floats.

    Raises:
        InputError: a key, at any depth, that the dataclass does not have; a truth value where a number belongs.
    """
    dotted = f"{prefix}." if prefix else ""
    if isinstance(value, Mapping):
        if inner_dataclass(kind) is None and get_origin(kind) not in (dict, Mapping):
            return value
        return {
            key: conform(field_type(kind, str(key), prefix, source), item, source, f"{dotted}{key}")
            for key, item in value.items()
        }
    wants = get_args(kind) if get_origin(kind) in (Union, types.UnionType) else (kind,)
    if isinstance(value, bool) and bool not in wants and (int in wants or float in wants):
        raise InputError(f"{source}: {prefix} must be a number, got {value}")
    if isinstance(value, int) and float in wants and int not in wants and not isinstance(value, bool):
        return float(value)
    if (
        isinstance(value, str)
        and any((get_origin(want) or want) in (tuple, list) for want in wants)
        and str not in wants
    ):
        raise InputError(f"{source}: {prefix} must be a list, got {value!r}")
    if isinstance(value, (list, tuple)):
        for want in wants:
            if (get_origin(want) or want) in (tuple, list):
                return _sequence(want, value, source, prefix)
    return value


def _sequence(kind: Any, values: Sequence[Any], source: str, prefix: str) -> Any:
    inner = get_args(kind) or (Any,)
    one_kind = len(inner) == 1 or inner[-1] is Ellipsis
    kinds = [inner[0]] * len(values) if one_kind else list(inner)
    if len(kinds) != len(values):
        raise InputError(f"{source}: {prefix} must have {len(kinds)} values, got {len(values)}")
    items = [conform(k, v, source, f"{prefix}[{i}]") for i, (k, v) in enumerate(zip(kinds, values, strict=True))]
    return tuple(items) if (get_origin(kind) or kind) is tuple else items


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
        with contextlib.suppress(OSError):  # no system takes a name of 300 letters
            if candidate.is_file():
                return candidate
    if is_path:
        folder, there = Path(text).parent, []
        with contextlib.suppress(OSError):
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
