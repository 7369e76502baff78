"""How commands read their options: a dataclass whose field docstrings are the help; wrong options are one line."""

from __future__ import annotations

import contextlib
import io
import re
from dataclasses import fields
from typing import Any, TypeVar

import tyro

from vinl.config.errors import InputError

T = TypeVar("T")
_FRAME = " │╰╯─"
_SETTING = re.compile(r"[A-Za-z_][\w.]*=")


def parse_options(options: type[T] | Any, argv: list[str], command: str, *markers: Any) -> T:
    """Options from the command line; ``--help`` prints them and ends the process.

    Args:
        options: dataclass, or a union of them as subcommands; its docstring and those of its fields become the help.
        argv: arguments after the command.
        command: ``"eval"``, for the usage line.
        markers: further ``tyro.conf`` settings.

    Raises:
        InputError: an option is unknown, missing or of the wrong type; one line, with the option that was meant.
    """
    said = io.StringIO()
    try:
        with contextlib.redirect_stderr(said):
            return tyro.cli(options, args=argv, prog=f"vinl {command}", config=(tyro.conf.FlagCreatePairsOff, *markers))
    except SystemExit as end:
        if not end.code:
            raise
        raise InputError(f"{_essence(said.getvalue())} (vinl {command} --help lists the options)") from None


def settings_first(options: type[Any], argv: list[str]) -> list[str]:
    """Bring the words ``key=value`` of a command line together at its front, wherever they stood among the flags.

    Args:
        options: dataclass of the command; tells flags with a value from those without.
        argv: arguments after the command.
    """
    switches = {"--" + field.name.replace("_", "-") for field in fields(options) if field.type in (bool, "bool")}
    settings: list[str] = []
    others: list[str] = []
    for k, word in enumerate(argv):
        last = argv[k - 1] if k else ""
        is_value = last.startswith("--") and "=" not in last and last not in switches
        (settings if _SETTING.match(word) and not is_value else others).append(word)
    return settings + others


def _essence(box: str) -> str:
    """The first statement in tyro's box, under its title, and the option that it supposes was meant."""
    lines = [line.strip(_FRAME) for line in box.splitlines()[1:]]
    lines = [line if line.strip("-") else "" for line in lines]  # a rule, drawn or of dashes, becomes an empty line
    while lines and not lines[0]:
        lines.pop(0)
    first = " ".join(lines[: lines.index("")] if "" in lines else lines)
    for k, line in enumerate(lines[:-1]):
        if line.startswith(("Perhaps you meant", "Did you mean")):
            return f"{first}, did you mean {lines[k + 1].split(',')[0].split()[0]}?"
    return first
