"""An image network through ``torch.compile``, held against itself: what does not compute the same is not used."""

from __future__ import annotations

import sys
from typing import Any

import torch
from torch import Tensor, nn

from vinl.nav.recurrent_model import as_unit

_WAYS: tuple[dict[str, Any], ...] = ({"comprehensive_padding": False}, {"layout_optimization": False})
"""Options that are tried in turn. With its own, torch 2.11 on an H200 computed other features where gradients were
asked for, and NaN after two steps (docs/research/2026-11-28-compiled-wrongly.md); likely it pads rows of 2,046 numbers
and reads them without [pytorch issue 179931]."""

_TOLERANCE = 0.1
"""Largest relative difference of the features. Measured with an untrained ResNet, 64 images, on a CPU: bfloat16 for
float32 makes 0.02, rows of other images 0.27, numbers shifted by two 1.2."""


class CompiledVision:
    """``torch.compile`` on an image network of a training, undone where its features come out otherwise.

    Args:
        vision: (n, height, width) images to (n, k) features; compiled in place, the names of its weights stay.
    """

    def __init__(self, vision: nn.Module) -> None:
        self._vision = vision
        self._ways = list(_WAYS)
        self._agreed: set[tuple[bool, torch.Size]] = set()
        self._compile()

    def check(self, depth: Tensor) -> None:
        """Hold features of the compiled network against the plain one's, once for every shape (t, n, height, width)
        with and without gradients, under the present autocast; where they differ, the next way is tried, then none."""
        case = torch.is_grad_enabled(), depth.shape
        while self._ways and case not in self._agreed:
            images = as_unit(depth).flatten(0, 1)
            features = self._vision(images).detach().float()
            with torch.no_grad():
                plain = self._vision.forward(images).float()
            difference = float((features - plain).norm() / plain.norm().clamp(min=1e-12))
            if difference < _TOLERANCE:  # not of NaN
                self._agreed.add(case)
                return
            way = self._ways.pop(0)
            print(f"warning: compiled with {way} the features differ by {difference:.0%}", file=sys.stderr)
            self._agreed.clear()
            self._compile()

    def _compile(self) -> None:
        if self._ways:
            self._vision.compile(dynamic=False, options=self._ways[0])
        else:
            print("warning: the image network is not compiled, which is slower", file=sys.stderr)
            self._vision._compiled_call_impl = None  # as of a module that never was compiled
