"""What a configuration dataclass expects: the type of a key, the keys that exist, the one that was probably meant."""

from __future__ import annotations

import dataclasses
import difflib
import types
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Union, get_args, get_origin, get_type_hints

from vinl.config.errors import InputError


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
