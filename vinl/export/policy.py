"""A policy as an ONNX file, written only if it answers as the policy does; torch's exporter is kept quiet and free of
traces of this machine."""

from __future__ import annotations

import contextlib
import json
import logging
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

import torch

from vinl.chain.workers import one_thread
from vinl.config.errors import InputError
from vinl.config.output import check_named, write_whole
from vinl.export.metadata import describe_step
from vinl.export.parity import LIMIT, ExportedPolicy, Parity, compare_steps, record_steps
from vinl.export.step import Step
from vinl.policies.depth_policy import DepthPolicy
from vinl.policies.io import load_policy
from vinl.policies.policy import LocomotionPolicy

if TYPE_CHECKING:
    import onnx
    import onnx_ir

STEPS = 1000
"""Steps that a file is checked on."""


@dataclass(frozen=True)
class Exported:
    """What was written: kind and name of the policy, the SHA-256 of its weights, as in the results of an evaluation,
    names and shapes of inputs and outputs, and how far file and policy agree."""

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
    """Write a policy as an ONNX file that needs nothing of vinl, and say what it takes and gives.

    File and policy have to agree to ``parity.LIMIT`` on so many steps, recorded in MuJoCo C. ``out`` ends with
    ``.onnx``; an older file is replaced. ``on_step`` is called with the steps recorded so far.

    Raises:
        InputError: the extra ``vinl[export]`` is not installed, there is no such policy, or the file cannot be written.
        ParityError: they do not agree; nothing was written.
    """
    check_extra()
    if steps < 1:
        raise InputError(f"steps must be at least 1, got {steps}")
    path, policy = check_file(out), load_policy(name_or_path)
    try:
        with write_whole(path) as file, one_thread():  # begun now: a place that cannot be written to is found at once
            model = build_model(policy).SerializeToString()
            exported = ExportedPolicy(model)
            parity = compare_steps(exported, record_steps(policy, steps, on_step))
            if not parity.is_kept:
                raise ParityError(
                    f"the file's actions differ from those of {policy.card.name} by {parity.worst:.1e}, more than "
                    f"{LIMIT:g}; nothing was written"
                )
            file.write(model)
    except OSError as error:
        raise InputError(f"cannot write {path}: {error.strerror}; choose another --out or make room") from None
    about = exported.about
    title = f"{about['kind']} policy {about['name']}"
    return Exported(title, about["weights_sha256"], exported.inputs, exported.outputs, parity)


def check_file(out: str | Path) -> Path:
    """A path that may be that of an ONNX file. Raises ``InputError`` if it is empty, ends otherwise, or is a folder."""
    path = check_named(out, "file")
    if path.suffix != ".onnx":
        raise InputError(f"--out {path} must end with .onnx")
    if path.is_dir():
        raise InputError(f"--out {path} is a folder; name a file in it")
    return path


PACKAGES = ("onnx", "onnxscript", "onnxruntime")
"""What ``vinl[export]`` installs: the format, torch's exporter to it, and the runtime that checks the file."""


def check_extra() -> None:
    """Refuse to begin where the extra is not installed. Raises ``InputError`` if a package is missing; says how to
    install it."""
    missing = [name for name in PACKAGES if find_spec(name) is None]
    if missing:
        raise InputError(f'export needs {", ".join(missing)}; install it: pip install "vinl[export]"')


_NOISY = "torch.onnx._internal.exporter._registration"
"""Says at each export that torchvision is not there, whose operators no policy has."""


def build_model(policy: LocomotionPolicy | DepthPolicy) -> onnx.ModelProto:
    """The policy's network for one robot, with its metadata: each value is JSON. Raises ``InputError`` if the policy
    observes or remembers something that cannot be described."""
    step = Step(policy).eval()
    about = describe_step(policy, step)
    with torch.no_grad():
        step(*step.example())  # what modules keep once they have made it must not be made while it is traced
    with _quiet():
        program = torch.onnx.export(
            step,
            step.example(),
            input_names=step.inputs,
            output_names=step.outputs,
            dynamo=True,
            verbose=False,
            external_data=False,
            custom_translation_table=_translations(),
            optimize=False,
        )
    assert program is not None
    _simplify(program.model)
    model = program.model_proto
    _strip(model)
    model.producer_name, model.producer_version = "vinl", about["vinl_version"]
    model.doc_string = f"{about['kind']} policy {about['name']} of vinl, one step of one robot; see the metadata"
    for key, value in about.items():
        model.metadata_props.add(key=key, value=json.dumps(value))
    return model


def _simplify(model: onnx_ir.Model) -> None:
    """What every runtime needs: torch's own pass looks besides for patterns, which takes far longer than the rest of an
    export and which runtimes find themselves."""
    from onnxscript import optimizer

    optimizer.inline(model)
    optimizer.fold_constants(model)
    optimizer.remove_unused_nodes(model)


def _translations() -> dict[Any, Any]:
    """Operators that torch's exporter does not know."""
    from onnxscript import opset20

    op: Any = opset20

    def hypot(a: Any, b: Any) -> Any:
        return op.Sqrt(op.Add(op.Mul(a, a), op.Mul(b, b)))

    return {torch.ops.prims.hypot.default: hypot}


@contextlib.contextmanager
def _quiet() -> Iterator[None]:
    """Torch's exporter uses a name of torch that torch gave up, and logs what concerns nobody."""
    log = logging.getLogger(_NOISY)
    before = log.level
    log.setLevel(logging.ERROR)
    try:
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", r"`isinstance\(treespec, LeafSpec\)`", FutureWarning)
            yield
    finally:
        log.setLevel(before)


def _strip(model: onnx.ModelProto) -> None:
    """Drop the traces of Python code, which name files of this machine."""
    del model.metadata_props[:]
    graph = model.graph
    for part in (graph, *graph.node, *graph.input, *graph.output, *graph.value_info, *graph.initializer):
        del part.metadata_props[:]
        part.ClearField("doc_string")
