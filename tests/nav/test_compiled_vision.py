"""A compiled image network that computes something else is not used."""

import pytest
import torch
from torch import nn

from vinl.nav.compiled_vision import _OPTIONS, CompiledVision
from vinl.policies.vision import SmallCnn

_WRONG = {
    "rows of other images": lambda features: features.roll(1, 0),
    "not a number": lambda features: features * torch.nan,
    "other gradients": lambda features: features.detach() + 3 * (features - features.detach()),
}


@pytest.mark.parametrize("wrong", _WRONG.values(), ids=_WRONG)
@pytest.mark.parametrize("wrong_ways", range(len(_OPTIONS) + 1))
def test_only_what_computes_the_same_is_used(wrong, wrong_ways, monkeypatch, capsys):
    tried = []

    def compile_as_told(self, dynamic, options):
        tried.append(options)
        right = len(tried) > wrong_ways

        def call(images):
            features = self.forward(images)
            return features if right or not torch.is_grad_enabled() else wrong(features)

        self._compiled_call_impl = call

    monkeypatch.setattr(nn.Module, "compile", compile_as_told)
    torch.manual_seed(0)
    vision, depth = SmallCnn(12, 16, 8), torch.rand(3, 4, 12, 16)
    compiled = CompiledVision(vision)
    for gradients in (False, True, False, True):
        with torch.set_grad_enabled(gradients):
            compiled.check(depth)
            assert torch.equal(vision(depth.flatten(0, 1)), vision.forward(depth.flatten(0, 1)))
    assert tried == list(_OPTIONS[: wrong_ways + 1])
    warnings = capsys.readouterr().err.splitlines()
    assert len(warnings) == wrong_ways + (wrong_ways == len(_OPTIONS))
    assert all(line.startswith("warning: ") for line in warnings)
