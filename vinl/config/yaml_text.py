"""YAML as people write it: ``1e-3`` is a number, a key may stand only once, errors name the line."""

from __future__ import annotations

import re
import types
from pathlib import Path
from typing import Any, Union, get_args, get_origin

import yaml

from vinl.config.errors import InputError


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
    "tag:yaml.org,2002:float",
    re.compile(r"^[-+]?(?:[0-9][0-9_]*)(?:\.[0-9_]*)?[eE][-+]?[0-9]+$"),
    list("-+0123456789"),
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
