"""The kernel that normalises in training does what the policy does; in Triton's interpreter, without a GPU."""

import os
import subprocess
import sys

import pytest

pytest.importorskip("triton", reason="Triton comes with torch for GPUs")

COMPARE = """
import torch
from torch.nn import functional
from vinl.nav.norm_kernel import group_norm

torch.manual_seed(0)
for channels, height, width, groups in ((32, 30, 40, 16), (64, 3, 5, 16), (11, 2, 3, 1)):
    given = 2 * torch.randn(3, channels, height, width) + 1, torch.randn(channels), torch.randn(channels)
    upstream = torch.randn(3, channels, height, width)

    def differentiate(function):
        x, weight, bias = (part.clone().requires_grad_() for part in given)
        y = function(x, weight, bias)
        return y, *torch.autograd.grad(y, (x, weight, bias), upstream)

    found = differentiate(lambda x, weight, bias: group_norm(x, weight, bias, groups, 1e-5)[0])
    wanted = differentiate(lambda x, weight, bias: functional.group_norm(x, groups, weight, bias, 1e-5))
    torch.testing.assert_close(found, wanted, rtol=1e-4, atol=1e-4)
"""


def test_kernel_normalises_and_differentiates() -> None:
    environment = os.environ | {"TRITON_INTERPRET": "1"}  # read when Triton is imported
    subprocess.run([sys.executable, "-c", COMPARE], env=environment, check=True)
