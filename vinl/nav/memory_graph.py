"""The loop over time of a memory as one CUDA graph, forward and back: the 48 steps of a minibatch are 1,900 launches,
which take 23 ms one by one, and 9 ms as a graph on an H200."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import torch
from torch import Tensor, nn

from vinl.policies.depth_memory import DepthMemory, State


class MemoryGraph:
    """Does what ``DepthMemory.remember`` does; where gradients are asked for as a graph, one for each shape.

    Args:
        memory: on a GPU.
    """

    def __init__(self, memory: DepthMemory) -> None:
        self._memory = memory
        # recorded on a stream of their own, weights would be warned of at the first step; there is nothing to wait for
        torch.autograd.graph.set_warn_on_accumulate_grad_stream_mismatch(False)
        self._graphs: dict[torch.Size, Callable[..., Any]] = {}

    def __call__(self, x: Tensor, state: State, fresh: Tensor) -> tuple[Tensor, State]:
        """See ``DepthMemory.remember``; the state carries no gradients."""
        if not torch.is_grad_enabled():
            return self._memory.remember(x, state, fresh)
        if x.shape not in self._graphs:
            sample = (torch.rand_like(x, requires_grad=True), *(part.clone() for part in state), fresh.clone())
            self._graphs[x.shape] = torch.cuda.make_graphed_callables(_Loop(self._memory), sample)
        feature, *after = self._graphs[x.shape](x, *state, fresh)
        return feature, tuple(after)


class _Loop(nn.Module):
    def __init__(self, memory: DepthMemory) -> None:
        super().__init__()
        self.cells = memory.cells
        self._remember = memory.remember

    def forward(self, x: Tensor, hidden: Tensor, cell: Tensor, fresh: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        feature, (hidden, cell) = self._remember(x, (hidden, cell), fresh)
        return feature, hidden.detach(), cell.detach()
