"""Thousands of small launches as one: a function that is recorded once on the GPU and then replayed."""

from __future__ import annotations

from collections.abc import Callable, Hashable

import torch
from torch import Tensor

_WARM_UP = 3
"""So many first calls run as they are, on a stream of their own, so that libraries set up what they need."""


class StepGraph:
    """Calls a function of an index: after the first calls as one CUDA graph.

    The function may read and write only tensors that stay where they are, must not wait for the device, and must set
    gradients to None before it computes any.

    Args:
        step: takes an index (n,) of always the same length; what it returns is not looked at.
    """

    def __init__(self, step: Callable[[Tensor], None]) -> None:
        self._step = step
        self._graphs: dict[Hashable, torch.cuda.CUDAGraph] = {}
        self._counts: dict[Hashable, int] = {}
        self._index: Tensor | None = None

    def run(self, index: Tensor, variant: Hashable = None) -> None:
        """One step.

        Args:
            index: (n,) whole numbers.
            variant: what the function branches on; each variant is a graph of its own.
        """
        if self._index is None:
            self._index = index.clone()
        self._index.copy_(index)
        if variant not in self._graphs:
            count = self._counts[variant] = self._counts.get(variant, 0) + 1
            if count <= _WARM_UP:
                self._run_beside()
                return
            graph = torch.cuda.CUDAGraph()
            # thread_local: what JAX's threads ask of the device meanwhile is none of this capture's business
            with torch.cuda.graph(graph, capture_error_mode="thread_local"):
                self._step(self._index)
            self._graphs[variant] = graph
        self._graphs[variant].replay()

    def _run_beside(self) -> None:
        assert self._index is not None
        side = torch.cuda.Stream()
        side.wait_stream(torch.cuda.current_stream())
        with torch.cuda.stream(side):
            self._step(self._index)
        torch.cuda.current_stream().wait_stream(side)
