"""Array shapes and types are checked in every test, but not in every call: a loop asks the same a thousand times, and a
check costs more than many of the functions that it stands before. Arguments of new types or shapes always are."""

from __future__ import annotations

import functools
from types import CodeType, FunctionType
from typing import TYPE_CHECKING, Any

import jaxtyping

if TYPE_CHECKING:
    from collections.abc import Callable

_FIRST, _EVERY = 10, 50
"""Calls of a function that are checked in each test: so many, then every fiftieth."""

_check_all = jaxtyping.jaxtyped
_is_compiling: Callable[[], bool]
_calls: dict[CodeType, int] = {}
_seen: set[tuple[Any, ...]] = set()
"""How often each function was called in this test, and with arguments of which types and shapes."""


_arrays: dict[type, bool] = {}
"""Whether what is of a type has a shape and a kind of numbers."""


def begin_test() -> None:
    """Check the first calls of every function again."""
    _calls.clear()
    _seen.clear()


def install() -> None:
    """Let ``jaxtyping.install_import_hook`` check sparingly what is imported from now on."""
    import torch  # not before the number of its threads is set

    global _is_compiling
    _is_compiling = torch.compiler.is_compiling
    jaxtyping.jaxtyped = _check_sparingly  # type: ignore[assignment]


def _check_sparingly(*, typechecker: Callable[..., Any]) -> Callable[[Any], Any]:
    whole = _check_all(typechecker=typechecker)

    def decorate(fn: Any) -> Any:
        if not isinstance(fn, FunctionType):
            return whole(fn)
        code, checked = fn.__code__, None

        @functools.wraps(fn)
        def call(*args: Any, **kwargs: Any) -> Any:
            nonlocal checked
            if _is_compiling():  # what is counted would become a part of the program
                return fn(*args, **kwargs)
            count = _calls[code] = _calls.get(code, 0) + 1
            given: tuple[Any, ...] = (code, *map(_describe, args))
            if kwargs:
                given += (*kwargs, *map(_describe, kwargs.values()))
            if count > _FIRST and count % _EVERY and given in _seen:
                return fn(*args, **kwargs)
            if checked is None:  # only now: to write a checker takes a millisecond, and inner functions are made often
                checked = whole(fn)
            answer = checked(*args, **kwargs)
            _seen.add(given)  # what was right once, and only that, is taken as right again
            return answer

        return call

    return decorate


def _describe(value: Any) -> Any:
    """Type, shape and kind of numbers: what a check looks at."""
    kind = type(value)
    is_array = _arrays.get(kind)
    if is_array is None:  # asked once: a look for an attribute that is not there takes longer than all the rest
        is_array = _arrays[kind] = isinstance(getattr(value, "shape", None), tuple) and hasattr(value, "dtype")
    return (kind, value.shape, value.dtype) if is_array else kind
