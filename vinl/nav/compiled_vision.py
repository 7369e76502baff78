"""An image network through ``torch.compile``, with a kernel for its norms, held against itself: what does not compute
the same is not used."""

from __future__ import annotations

import sys
from typing import Any

import torch
from torch import Tensor

from vinl.nav.recurrent_model import as_unit
from vinl.policies.vision import GroupNorm, Vision

_OPTIONS: tuple[dict[str, Any], ...] = ({"comprehensive_padding": False}, {"layout_optimization": False})
"""Options of ``torch.compile`` that are tried in turn. With its own, torch 2.11 on an H200 computed other features
where gradients were asked for, and NaN after two steps (docs/research/2026-11-28-compiled-wrongly.md); likely it pads
rows of 2,046 numbers and reads them without [pytorch issue 179931]."""

_TOLERANCE = 0.1
"""Largest relative difference of the features. Measured with an untrained ResNet, 64 images, on a CPU: bfloat16 for
float32 makes 0.02, rows of other images 0.27, numbers shifted by two 1.2."""

_GRADIENTS = 0.5
"""Largest relative difference of the weights' gradients. Two ways in bfloat16 differ by 0.2 on an H200."""

_IMAGES = 256
"""So many images' gradients are looked at."""


class CompiledVision:
    """``torch.compile`` on an image network of a training, undone where it computes something else.

    Args:
        vision: (n, height, width) images to (n, k) features; compiled in place, the names of its weights stay.
    """

    def __init__(self, vision: Vision) -> None:
        self._vision = vision
        self._norms = [part for part in vision.modules() if isinstance(part, GroupNorm)]
        kernel = _find_kernel(self._norms) if self._norms else None
        self._ways = [(None, options) for options in _OPTIONS]
        if kernel is not None:
            self._ways.insert(0, (kernel, _OPTIONS[0]))
        self._agreed: set[tuple[bool, torch.Size]] = set()
        self._compile()

    def check(self, depth: Tensor) -> None:
        """Hold the compiled network against the plain one, once for every shape (t, n, height, width) with and without
        gradients, under the present autocast; where they differ, the next way is tried, then none."""
        case = torch.is_grad_enabled(), depth.shape
        while self._ways and case not in self._agreed:
            difference, of_gradients = self._measure(as_unit(depth).flatten(0, 1))
            if difference < _TOLERANCE and of_gradients < _GRADIENTS:  # not of NaN
                self._agreed.add(case)
                return
            kernel, options = self._ways.pop(0)
            way = f"compiled with {options}" + (" and a kernel for norms" if kernel else "")
            said = f"the features differ by {difference:.0%}, their gradients by {of_gradients:.0%}"
            print(f"warning: {way} {said}", file=sys.stderr)
            self._agreed.clear()
            self._compile()

    def _measure(self, images: Tensor) -> tuple[float, float]:
        """Relative differences of features and, if these are asked for, gradients."""
        features = self._vision(images)
        kernel = self._ways[0][0]
        self._take_kernel(None)
        with torch.no_grad():
            plain = self._vision.forward(images)
        difference, of_gradients = _difference([features.detach()], [plain]), 0.0
        if torch.is_grad_enabled():
            wanted = self._gradients(self._vision.forward(images[:_IMAGES]))
            of_gradients = _difference(self._gradients(features), wanted)
        self._take_kernel(kernel)
        return difference, of_gradients

    def _gradients(self, features: Tensor) -> list[Tensor]:
        energy = features[:_IMAGES].float().square().sum()
        return list(torch.autograd.grad(energy, [w for w in self._vision.parameters() if w.requires_grad]))

    def _compile(self) -> None:
        kernel, options = self._ways[0] if self._ways else (None, None)
        self._take_kernel(kernel)
        if self._norms:  # the kernel reads maps whose channels lie last
            layout = torch.channels_last if kernel else torch.contiguous_format
            self._vision.to(memory_format=layout)  # pyright: ignore[reportCallIssue]
            self._vision.channels_last = bool(kernel)
        if options:
            self._vision.compile(dynamic=False, options=options)
        else:
            print("warning: the image network is not compiled, which is slower", file=sys.stderr)
            self._vision._compiled_call_impl = None  # as of a module that never was compiled

    def _take_kernel(self, kernel: Any) -> None:
        for norm in self._norms:
            norm.kernel = kernel


def _find_kernel(norms: list[GroupNorm]) -> Any:
    from vinl.nav.norm_kernel import group_norm  # Triton

    fitting = all(norm.num_groups == 1 or norm.num_channels.bit_count() == 1 for norm in norms)
    return group_norm if fitting else None


def _difference(some: list[Tensor], others: list[Tensor]) -> float:
    def length(parts: list[Tensor]) -> float:
        return float(torch.stack([part.norm() for part in parts]).norm())

    apart = [a.float() - b.float() for a, b in zip(some, others, strict=True)]
    return length(apart) / max(length([b.float() for b in others]), 1e-12)
