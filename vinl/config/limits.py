"""Numbers and ranges of a configuration, held to their limits."""

from __future__ import annotations

import math
import numbers
from collections.abc import Callable

from vinl.config.errors import InputError

Range = tuple[float, float]
"""From least to most."""


_RULES: dict[str, tuple[str, Callable[[float], bool]]] = {
    "positive": ("be positive", lambda value: value > 0),
    "unsigned": ("not be negative", lambda value: value >= 0),
    "counts": ("be at least 1", lambda value: value >= 1),
    "fractions": ("lie between 0 and 1", lambda value: 0 <= value <= 1),
}


def check_fields(config: object, group: str = "", **names: tuple[str, ...]) -> None:
    """Hold fields of a record, and both ends of those that are ranges, to what is usual; None is always right.

    Args:
        config: the record.
        group: what stands before the names in a message, as ``"ppo."``.
        names: the fields that must be ``positive``, ``unsigned`` (not negative), ``counts`` (at least 1), ``fractions``
            (from 0 to 1), or ``rising`` ranges.

    Raises:
        InputError: one is not.
    """
    for rule, fields in names.items():
        for name in fields:
            value = getattr(config, name)
            if value is None:
                continue
            if rule == "rising":
                if not value[0] <= value[1]:
                    raise InputError(f"{group}{name} must be a rising range, got {value[0]} to {value[1]}")
            elif not all(map(_RULES[rule][1], value if isinstance(value, tuple) else (value,))):
                raise InputError(f"{group}{name} must {_RULES[rule][0]}, got {value}")


def check_range(name: str, value: Range, least: float = -math.inf, most: float = math.inf) -> None:
    """Hold a range to limits.

    Raises:
        InputError: it falls, or leaves ``least`` to ``most``, or is not finite.
    """
    if not (math.isfinite(value[0]) and math.isfinite(value[1]) and least <= value[0] <= value[1] <= most):
        raise InputError(
            f"{name} must be a rising range within {least:g} to {most:g}, got {value[0]:g} to {value[1]:g}"
        )


def check_number(name: str, value: float, least: float = 0.0, most: float = math.inf) -> None:
    """Hold a number to limits.

    Raises:
        InputError: it is none, leaves ``least`` to ``most``, or is not finite.
    """
    if not isinstance(value, numbers.Real):
        raise InputError(f"{name} must be a number, got {value!r}")
    if not (math.isfinite(value) and least <= value <= most):
        raise InputError(f"{name} must lie between {least:g} and {most:g}, got {value:g}")


def check_limits(config: object, group: str = "", **limits: Range) -> None:
    """Hold fields of a record, numbers or ranges, to limits from least to most; None is always right.

    Raises:
        InputError: one leaves them, or is not finite; ``group`` stands before its name.
    """
    for name, (least, most) in limits.items():
        value = getattr(config, name)
        if isinstance(value, tuple):
            check_range(f"{group}{name}", value, least, most)
        elif value is not None:
            check_number(f"{group}{name}", value, least, most)
