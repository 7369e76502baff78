"""From a policy to an ONNX model: torch's exporter, kept quiet and free of traces of this machine."""

from __future__ import annotations

import contextlib
import json
import logging
import warnings
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import torch

from vinl.export.metadata import describe_step
from vinl.export.step import Step
from vinl.policies.depth_policy import DepthPolicy
from vinl.policies.policy import LocomotionPolicy

if TYPE_CHECKING:
    import onnx

_NOISY = "torch.onnx._internal.exporter._registration"
"""Says at each export that torchvision is not there, whose operators no policy has."""


def build_model(policy: LocomotionPolicy | DepthPolicy) -> onnx.ModelProto:
    """The policy's network for one robot, with its metadata: each value is JSON.

    Raises:
        InputError: the policy observes or remembers something that cannot be described.
    """
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
        )
    assert program is not None
    model = program.model_proto
    _strip(model)
    model.producer_name, model.producer_version = "vinl", about["vinl_version"]
    model.doc_string = f"{about['kind']} policy {about['name']} of vinl, one step of one robot; see the metadata"
    for key, value in about.items():
        model.metadata_props.add(key=key, value=json.dumps(value))
    return model


def _translations() -> dict[Any, Any]:
    """Operators that torch's exporter does not know."""
    from onnxscript import opset20

    op: Any = opset20

    def hypot(a: Any, b: Any) -> Any:
        return op.Sqrt(op.Add(op.Mul(a, a), op.Mul(b, b)))

    return {torch.ops.prims.hypot.default: hypot}


def read_metadata(properties: dict[str, str]) -> dict[str, Any]:
    """The metadata as it was, from what a runtime or ``onnx`` reads from the file."""
    return {key: json.loads(value) for key, value in properties.items()}


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
