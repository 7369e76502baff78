"""A policy as an ONNX file, written only if it answers as the policy does."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

from vinl.chain.workers import one_thread
from vinl.config.errors import InputError
from vinl.export.onnx_file import build_model
from vinl.export.parity import LIMIT, ExportedPolicy, Parity, compare_steps
from vinl.export.recording import record_steps
from vinl.policies.io import load_policy

STEPS = 1000
"""Steps that a file is checked on."""


@dataclass(frozen=True)
class Exported:
    """What was written.

    Attributes:
        title: kind and name of the policy.
        weights: SHA-256 of the weights, as in the results of an evaluation.
        inputs, outputs: names and shapes.
        parity: how far file and policy agree.
    """

    title: str
    weights: str
    inputs: dict[str, tuple[int, ...]]
    outputs: dict[str, tuple[int, ...]]
    parity: Parity


class ParityError(Exception):
    """The exported file answers otherwise than the policy."""


def export_policy(
    name_or_path: str | Path, out: str | Path, steps: int = STEPS, on_step: Callable[[int], None] = lambda _: None
) -> Exported:
    """Write a policy as an ONNX file that needs nothing of vinl.

    Args:
        name_or_path: as for ``load_policy``.
        out: the file, which ends with ``.onnx``; an older one is replaced.
        steps: recorded in MuJoCo C, on which file and policy have to agree to ``parity.LIMIT``.
        on_step: called with the steps recorded so far.

    Returns:
        What the file takes and gives, and how far it agrees with the policy.

    Raises:
        InputError: the extra ``vinl[export]`` is not installed, there is no such policy, or the file cannot be written.
        ParityError: they do not agree; nothing was written.
    """
    check_extra()
    if steps < 1:
        raise InputError(f"steps must be at least 1, got {steps}")
    path, policy = check_file(out), load_policy(name_or_path)
    with _draft(path) as draft:
        draft.write_bytes(build_model(policy).SerializeToString())
        with one_thread():
            exported = ExportedPolicy(draft)
            parity = compare_steps(exported, record_steps(policy, steps, on_step))
        if not parity.is_kept:
            raise ParityError(
                f"the file's actions differ from those of {policy.card.name} by {parity.worst:.1e}, more than "
                f"{LIMIT:g}; nothing was written"
            )
    about = exported.about
    title = f"{about['kind']} policy {about['name']}"
    return Exported(title, about["weights_sha256"], exported.inputs, exported.outputs, parity)


def check_file(out: str | Path) -> Path:
    """A path that an ONNX file can be written to, its folder made.

    Raises:
        InputError: it ends otherwise, is a folder, or lies where nothing can be written.
    """
    path = Path(out)
    if path.suffix != ".onnx":
        raise InputError(f"--out {path} must end with .onnx")
    if path.is_dir():
        raise InputError(f"--out {path} is a folder; name a file in it")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"cannot write {path}: {path.parent}: {error.strerror}; choose another --out") from None
    return path


@contextmanager
def _draft(path: Path) -> Iterator[Path]:
    """A file that takes the place of another when all went well, and leaves nothing behind if not."""
    try:
        with tempfile.TemporaryDirectory(prefix=f".{path.name}-", dir=path.parent) as scratch:
            draft = Path(scratch) / path.name
            yield draft
            draft.replace(path)
    except OSError as error:
        raise InputError(f"cannot write {path}: {error.strerror}; choose another --out or make room") from None


PACKAGES = ("onnx", "onnxscript", "onnxruntime")
"""What ``vinl[export]`` installs: the format, torch's exporter to it, and the runtime that checks the file."""


def check_extra() -> None:
    """Refuse to begin where the extra is not installed.

    Raises:
        InputError: a package is missing; says how to install it.
    """
    missing = [name for name in PACKAGES if find_spec(name) is None]
    if missing:
        raise InputError(f'export needs {", ".join(missing)}; install it: pip install "vinl[export]"')
