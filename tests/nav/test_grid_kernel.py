"""The kernel that spreads distances in training does what the policy does; in Triton's interpreter, without a GPU."""

import pytest
import torch

from vinl.policies.grid_path import FAR, spread
from vinl.policies.occupancy_grid import CELL, SIDE

pytest.importorskip("triton", reason="Triton comes with torch for GPUs")


def test_kernel_finds_the_distances_of_the_policy(monkeypatch):
    monkeypatch.setenv("TRITON_INTERPRET", "1")
    from vinl.nav.grid_kernel import spread_in_blocks

    walls = torch.rand(2, SIDE, SIDE, generator=torch.Generator().manual_seed(0)) < 0.2
    cost = torch.where(walls, 20.0, CELL)
    distance = torch.full_like(cost, FAR)
    distance[:, SIDE // 3, SIDE // 2] = 0.0
    torch.testing.assert_close(spread_in_blocks(distance, cost), spread(distance, cost))
