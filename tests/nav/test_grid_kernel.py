"""The kernel that spreads distances in training does what the policy does; in Triton's interpreter, without a GPU."""

import os
import subprocess
import sys

import pytest

pytest.importorskip("triton", reason="Triton comes with torch for GPUs")

COMPARE = """
import torch
from vinl.nav.grid_kernel import spread_in_blocks
from vinl.policies.grid_path import FAR, spread
from vinl.policies.occupancy_grid import CELL

SIDE = 40  # not a power of two, which lanes are
walls = torch.rand(2, SIDE, SIDE, generator=torch.Generator().manual_seed(0)) < 0.2
cost = torch.where(walls, 20.0, CELL)
distance = torch.full_like(cost, FAR)
distance[:, SIDE // 3, SIDE // 2] = 0.0
torch.testing.assert_close(spread_in_blocks(distance, cost), spread(distance, cost))
"""


def test_kernel_finds_the_distances_of_the_policy():
    environment = os.environ | {"TRITON_INTERPRET": "1"}  # read when Triton is imported
    subprocess.run([sys.executable, "-c", COMPARE], env=environment, check=True)
