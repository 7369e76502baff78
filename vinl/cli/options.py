"""How commands read their options: a dataclass whose field docstrings are the help; wrong options, configs and runs of
the other training are one line."""

from __future__ import annotations

import ast
import contextlib
import dataclasses
import importlib
import inspect
import io
import re
import textwrap
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeVar, cast, get_args, get_origin, get_type_hints

import tyro

from vinl.config.errors import InputError
from vinl.config.loader import closest
from vinl.config.words import count_things

if TYPE_CHECKING:
    from vinl.chain.config import EvaluationConfig


T = TypeVar("T")
_FRAME = " │╰╯─"
_SETTING = re.compile(r"[A-Za-z_][\w.]*=")
_WORDS: dict[Any, tuple[str, str]] = {
    int: ("N", "a whole number"),
    float: ("X", "a number"),
    str: ("TEXT", "text"),
    Path: ("PATH", "a path"),
}
"""What stands for a value in the help, and in an error."""

Settings = Annotated[
    tuple[str, ...], tyro.conf.Positional, tyro.conf.arg(metavar="[KEY=VALUE ...]", help_behavior_hint="")
]
"""Type of a field for ``settings_first``'s words."""


def parse_options(options: type[T] | Any, argv: list[str], command: str, *markers: Any) -> T:
    """Options from the command line; ``--help`` prints them and ends the process.

    Args:
        options: dataclass; its docstring and those of its fields become the help.
        argv: arguments after the command.
        command: ``"eval"``, for the usage line.
        markers: further ``tyro.conf`` settings.

    Raises:
        InputError: an option is unknown, missing or of the wrong type; one line, with the option that was meant.
    """
    _use_plain_words(options)
    said, settings = io.StringIO(), (tyro.conf.FlagCreatePairsOff, tyro.conf.DisallowNone, *markers)
    try:
        with contextlib.redirect_stderr(said):
            parsed = tyro.cli(options, args=argv, prog=f"vinl {command}", config=settings)
    except SystemExit as end:
        if not end.code:
            raise
        raise InputError(
            f"{_say_plainly(said.getvalue(), options)} (vinl {command} --help lists the options)"
        ) from None
    for word in getattr(parsed, "overrides", ()):
        if "=" not in word:
            raise InputError(
                f"{word!r} is no setting (key=value), and a name stands behind its option (vinl {command} --help "
                "lists the options)"
            )
    return parsed


def settings_first(options: type[Any], argv: list[str]) -> list[str]:
    """Bring the words ``key=value`` of a command line together at its front, wherever they stood among the flags.

    Args:
        options: dataclass of the command; tells flags with a value from those without.
        argv: arguments after the command.
    """
    fields = dataclasses.fields(options)
    switches = {"--" + field.name.replace("_", "-") for field in fields if field.type in (bool, "bool")}
    argv = [word for word in argv if word != "--set"]  # as it was written before
    settings: list[str] = []
    others: list[str] = []
    for k, word in enumerate(argv):
        last = argv[k - 1] if k else ""
        is_value = last.startswith("--") and "=" not in last and last not in switches
        (settings if _SETTING.match(word) and not is_value else others).append(word)
    return settings + others


def default_out(command: str, *names: str) -> Path:
    """``runs/eval-loco-nav`` for the command ``eval`` and these policies; of a folder, its name counts."""
    words = []
    for name in names:
        path = Path(name.rstrip("/"))
        last = path.parent.name if path.name == "policy" and path.parent.name else path.name
        words.append(re.sub(r"[^\w.-]+", "_", last) or "run")
    return Path("runs") / "-".join((command, *words))


def _kind(annotation: Any) -> Any:
    """What one value of a field is: the type in ``X | None`` or ``tuple[X, ...]``."""
    kinds = [kind for kind in get_args(annotation) if kind not in (type(None), Ellipsis)]
    return _kind(kinds[0]) if kinds and get_origin(annotation) is not None else annotation


def _use_plain_words(options: type[Any]) -> None:
    """Names of values as people write them, and no default where the help's own words tell it."""
    if "_plain" in options.__dict__:
        return
    hints, texts = get_type_hints(options, include_extras=True), _read_docstrings(options)
    for field in dataclasses.fields(options):
        hint = hints[field.name]
        told = field.default is None or isinstance(field.default, (bool, tuple)) or "tuple" in str(field.type)
        bare = get_args(hint)[0] if get_origin(hint) is Annotated else hint
        word = _WORDS.get(_kind(bare), (None, ""))[0]
        if word is not None and get_origin(bare) is tuple:
            word = f"{word} ..."
        own = [extra for extra in getattr(hint, "__metadata__", ()) if getattr(extra, "metavar", None) is not None]
        metavar, told_by_words = own[0].metavar if own else word, "" if told else None
        about = tyro.conf.arg(help=texts.get(field.name), metavar=metavar, help_behavior_hint=told_by_words)
        options.__annotations__[field.name] = Annotated[hint, about]
    options._plain = True


def _read_docstrings(options: type[Any]) -> dict[str, str]:
    """The string under each field as one paragraph: tyro would keep the line breaks of the source. What a class says
    of a field goes before what its bases say."""
    texts = {}
    for part in reversed([kind for kind in options.__mro__ if dataclasses.is_dataclass(kind)]):
        body = cast(ast.ClassDef, ast.parse(textwrap.dedent(inspect.getsource(part))).body[0]).body
        for field, below in pairwise(body):
            if (
                isinstance(field, ast.AnnAssign)
                and isinstance(below, ast.Expr)
                and isinstance(below.value, ast.Constant)
            ):
                name, words = cast(ast.Name, field.target).id, str(below.value.value)
                texts[name] = " ".join(words.replace("``", "").split())
    return texts


def _say_plainly(box: str, options: type[Any]) -> str:
    """What tyro says about a wrong option, in the words of the help."""
    said = _essence(box)
    wrong = re.match(r"Error parsing (?:--)?([\w.-]+)[^:]*: (?:no type matching|invalid|could not)[^']*'([^']*)'", said)
    hints = get_type_hints(options)
    name = wrong.group(1).replace("-", "_") if wrong else ""
    if wrong is None or name not in hints:
        return said
    kind = _kind(hints[name])
    wanted = _WORDS[kind][1] if kind in _WORDS else f"one of {', '.join(map(str, get_args(hints[name])))}"
    return f"--{wrong.group(1)} must be {wanted}, got {wrong.group(2)!r}"


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


COMMANDS = {"locomotion": "vinl train-loco", "navigation": "vinl train-nav"}
"""Kind of policy to the command that trains it."""

_FOLDERS = {"loco": "locomotion", "nav": "navigation", "eval": "evaluation", "sensors": "depth cameras"}
"""Folder of shipped configs to what they are of."""

_CONFIGS = {
    "locomotion": ("vinl.loco.config", "LocoConfig"),
    "navigation": ("vinl.nav.config", "NavConfig"),
    "evaluation": ("vinl.chain.config", "EvaluationConfig"),
    "depth cameras": ("vinl.sensing.sensor_config", "SensorConfig"),
}
"""What a config is of to module and name of its dataclass."""


def check_config(name: str, kind: str) -> None:
    """Refuse a config of another kind: of shipped ones the folder tells, of files the keys.

    Raises:
        InputError: it is one, or the file cannot be read.
    """
    if name.endswith((".yaml", ".yml")):
        found = _recognise(name, kind)
    else:
        found = _FOLDERS.get(name.removeprefix("configs/").split("/")[0], kind) if "/" in name else kind
    if found != kind:
        instead = f": use {COMMANDS[found]} --config {name}" if found in COMMANDS else ""
        raise InputError(f"--config {name} is a config of {found}, not of {kind}{instead}")


def _recognise(file: str, kind: str) -> str:
    """What a config file is of: ``kind``, unless it has keys that are not of it and another kind knows more of them."""
    from vinl.config.loader import read_config

    keys = set(read_config(file))

    def count_known(kind: str) -> int:
        module, name = _CONFIGS[kind]
        return len(keys & {field.name for field in dataclasses.fields(getattr(importlib.import_module(module), name))})

    known = count_known(kind)
    if known == len(keys):  # the other kinds need not be imported
        return kind
    others = {other: count_known(other) for other in _CONFIGS if other != kind}
    likely = max(others, key=lambda other: others[other])
    return likely if others[likely] > known else kind


def load_rules(config: str, overrides: Sequence[str], sensors: str | None, drift: float | None) -> EvaluationConfig:
    """The rules of episodes of the chain.

    Args:
        config: a shipped config or a YAML file.
        overrides: settings as ``key=value``.
        sensors: errors of the depth cameras: a shipped group's name, or a YAML file; None: as in the config.
        drift: of the odometry, a fraction; None: as in the config.

    Raises:
        InputError: a config of another kind, or a setting that is none.
    """
    from vinl.chain.config import EvaluationConfig
    from vinl.config.loader import list_configs, load_config

    check_config(config, "evaluation")
    errors = []
    if sensors is not None:
        groups = [name.removeprefix("sensors/") for name in list_configs() if name.startswith("sensors/")]
        is_file = sensors.endswith((".yaml", ".yml"))
        if not is_file and sensors not in groups:
            raise InputError(f"--sensors {sensors!r} is unknown{closest(sensors, groups)}; known: {', '.join(groups)}")
        errors.append(f"sensors={sensors if is_file else f'sensors/{sensors}'}")
    if drift is not None:
        errors.append(f"odometry.drift=[{drift},{drift}]")
    return load_config(EvaluationConfig, config, [*errors, *overrides])


def check_source(name: str, kind: str) -> None:
    """Refuse to start from a policy of the other kind.

    Raises:
        InputError: it is one, or there is none.
    """
    from vinl.policies.card import read_card
    from vinl.policies.io import find_policy

    card = read_card(find_policy(name))
    if card.kind != kind:
        raise InputError(f"--from {name} is a {card.kind} policy: use {COMMANDS[card.kind]}")


def check_run(folder: str, kind: str, iterations: int | None) -> None:
    """Refuse to resume a run of the other kind, or one that has all the iterations that are asked for.

    Raises:
        InputError: it is one, or no run.
    """
    from vinl.rl.run_folder import RunFolder

    run = RunFolder(folder)
    found = "navigation" if "homes" in run.open() else "locomotion"
    if found != kind:
        raise InputError(f"{folder} is a {found} run: use {COMMANDS[found]} --resume {folder}")
    row = run.read_last_metrics()
    done = 0 if row is None else int(row["iteration"])
    if iterations is not None and done >= iterations:
        raise InputError(f"{folder} already has {count_things(done, 'iteration')}; give more with --iterations")
