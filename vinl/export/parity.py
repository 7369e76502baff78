"""Whether an exported file answers as the policy did, on steps that a robot walked."""

from __future__ import annotations

import time
from collections.abc import Sequence as Many
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from vinl.export.onnx_file import read_metadata
from vinl.export.recording import Sequence
from vinl.export.step import DEPTH, OBSERVATION

LIMIT = 1e-4
"""Actions of file and policy may differ by so much, after any number of steps with memories of their own [1]."""


@dataclass(frozen=True)
class Parity:
    """How the file did.

    Attributes:
        steps: that were compared.
        episodes: that they belong to; the memory began anew in each.
        worst: largest difference between two actions [1].
        largest: largest action of the policy [1], to judge ``worst`` by.
        step_ms: median time of a step on one core [ms], the processor's own: others who use it do not count.
    """

    steps: int
    episodes: int
    worst: float
    largest: float
    step_ms: float

    @property
    def is_kept(self) -> bool:
        """Whether no difference is over the limit; one that is no number is."""
        return self.worst <= LIMIT


class ExportedPolicy:
    """An exported file, run by onnxruntime on one core, with its memory.

    Attributes:
        about: the file's metadata.
        inputs, outputs: names and shapes.
    """

    def __init__(self, path: Path | str) -> None:
        import onnxruntime

        options = onnxruntime.SessionOptions()
        options.intra_op_num_threads = options.inter_op_num_threads = 1
        self._session: Any = onnxruntime.InferenceSession(str(path), options, providers=["CPUExecutionProvider"])
        self.about = read_metadata(self._session.get_modelmeta().custom_metadata_map)
        self.inputs, self.outputs = (
            {port.name: tuple(port.shape) for port in ports}
            for ports in (self._session.get_inputs(), self._session.get_outputs())
        )
        self._states: dict[str, np.ndarray] = {}
        self.reset()

    def reset(self) -> None:
        """An episode begins."""
        states = self.about["states"]
        self._states = {
            one["input"]: np.broadcast_to(np.float32(one["start"]), one["shape"]).astype(np.float32) for one in states
        }

    def act(self, observation: np.ndarray, depth: np.ndarray | None = None) -> np.ndarray:
        """The action (a,) for a scaled observation (k,) and depth (height, width) [m], if it sees."""
        given = {OBSERVATION: observation[None], **self._states}
        if depth is not None:
            given[DEPTH] = depth[None]
        action, *states = self._session.run(None, given)
        self._states = dict(zip(self._states, states, strict=True))
        return action[0]


def compare_steps(exported: ExportedPolicy, recorded: Many[Sequence]) -> Parity:
    """Ask the file what the policy was asked, in the same order."""
    worst, largest, spent = 0.0, 0.0, []
    for sequence in recorded:
        exported.reset()
        for k, (observation, action) in enumerate(zip(sequence.observations, sequence.actions, strict=True)):
            begin = time.thread_time()
            answer = exported.act(observation, sequence.depths[k] if sequence.depths else None)
            spent.append(time.thread_time() - begin)
            worst = float(np.maximum(worst, np.abs(answer - action).max()))  # keeps NaN, unlike max
            largest = max(largest, float(np.abs(action).max()))
    return Parity(len(spent), len(recorded), worst, largest, 1000 * float(np.median(spent)))
