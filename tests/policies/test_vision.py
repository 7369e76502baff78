"""Group normalisation is the same where torch.compile fuses it."""

import torch
from torch import nn

from vinl.policies.vision import GroupNorm


def test_compiled_norm_is_the_plain_one_and_so_are_its_derivatives() -> None:
    generator = torch.Generator().manual_seed(0)
    norm = GroupNorm(4, 8).double()
    for weight in norm.parameters():
        nn.init.normal_(weight, generator=generator)
    maps = torch.randn(3, 8, 5, 7, generator=generator, dtype=torch.float64)
    maps[0] = 0.3  # what is behind an image without depth
    compiled = torch.compile(norm, backend="aot_eager")
    found = []
    for layer in (norm, compiled):
        norm.zero_grad()
        inputs = maps.clone().requires_grad_()
        output = layer(inputs)
        output.square().sum().backward()
        assert inputs.grad is not None and norm.weight.grad is not None
        found.append((output.detach(), inputs.grad, norm.weight.grad.clone()))
    for plain, fused in zip(*found, strict=True):
        torch.testing.assert_close(fused, plain)
