"""Numbers and ranges of a configuration, held to their limits."""

from __future__ import annotations

import math

from vinl.config.errors import InputError

Range = tuple[float, float]
"""From least to most."""


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
        InputError: it leaves ``least`` to ``most``, or is not finite.
    """
    if not (math.isfinite(value) and least <= value <= most):
        raise InputError(f"{name} must lie between {least:g} and {most:g}, got {value:g}")
