"""How commands read their options: a dataclass, whose field docstrings are the help; wrong options are one line."""

from __future__ import annotations

import contextlib
import io
import re
from typing import TypeVar

import tyro

from vinl.config.errors import InputError

T = TypeVar("T")
_RULE = re.compile(r"^[\s│|]*[─\-]{5,}[\s│|]*$")


def parse_options(options: type[T], argv: list[str], command: str) -> T:
    """Options from the command line; ``--help`` prints them and ends the process.

    Args:
        options: dataclass; its docstring and those of its fields become the help.
        argv: arguments after the command.
        command: ``"eval"``, for the usage line.

    Raises:
        InputError: an option is unknown, missing or of the wrong type; one line, with the option that was meant.
    """
    said = io.StringIO()
    try:
        with contextlib.redirect_stderr(said):
            return tyro.cli(options, args=argv, prog=f"vinl {command}", config=(tyro.conf.FlagCreatePairsOff,))
    except SystemExit as end:
        if not end.code:
            raise
        raise InputError(f"{_essence(said.getvalue())} (vinl {command} --help lists the options)") from None


def _essence(box: str) -> str:
    """The first statement in tyro's box, and the option that it supposes was meant."""
    lines = [line.strip(" │|") for line in box.splitlines() if not line.strip().startswith(("╭", "╰", "+"))]
    rules = [k for k, line in enumerate(lines) if _RULE.match(line)]
    first = " ".join(line for line in lines[: rules[0] if rules else None] if line)
    for k, line in enumerate(lines[:-1]):
        if line.startswith(("Perhaps you meant", "Did you mean")):
            return f"{first}, did you mean {lines[k + 1].split(',')[-1].split()[0]}?"
    return first
