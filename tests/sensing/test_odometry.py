"""Dead reckoning: exact without errors, off by as much as it says with them."""

import math

import pytest
import torch

from vinl.config.errors import InputError
from vinl.sensing.odometry import Odometry
from vinl.sensing.sensor_config import OdometryConfig

N = 4000


def start(config: OdometryConfig, position: torch.Tensor) -> Odometry:
    odometry = Odometry(config, N)
    odometry.restart(torch.arange(N, dtype=torch.int32), torch.ones(N, dtype=torch.bool), position)
    return odometry


def test_without_errors_it_is_where_it_is():
    place = torch.rand(N, 2)
    odometry = start(OdometryConfig((0.0, 0.0)), place)
    for _ in range(5):
        there = place + torch.rand(N, 2) - 0.5
        odometry.advance(place, there)
        place = there
    torch.testing.assert_close(odometry.state["estimate"][:, :2], place, atol=1e-5, rtol=0)
    assert not odometry.state["estimate"][:, 2].any() and OdometryConfig().is_exact


def test_distances_are_off_by_the_drift_and_headings_bend_the_way():
    place = torch.zeros(N, 2)
    odometry = start(OdometryConfig((0.02, 0.02), yaw_bias=0.0), place)
    assert sorted(odometry.state["errors"][:, 0].unique().tolist()) == pytest.approx([0.98, 1.02])
    odometry = start(OdometryConfig((0.02, 0.02)), place)
    bend = odometry.state["errors"][:, 1]
    assert bend.abs().max() == pytest.approx(0.002, rel=0.01) and bend.std() == pytest.approx(0.002 / 3**0.5, rel=0.05)
    for k in range(20):  # 10 m straight on
        odometry.advance(torch.tensor([[0.5 * k, 0.0]]).expand(N, 2), torch.tensor([[0.5 * k + 0.5, 0.0]]).expand(N, 2))
    estimate = odometry.state["estimate"]
    torch.testing.assert_close(estimate[:, 2], 10 * bend, atol=1e-6, rtol=1e-4)
    torch.testing.assert_close(estimate[:, 1], 10 * 5 * bend, atol=1e-3, rtol=0.03)  # a circle's arc: bend x way^2 / 2
    assert estimate[:, 0].numpy() == pytest.approx(10.0, abs=0.21)


def test_an_episode_keeps_its_errors_until_it_starts_anew():
    odometry = start(OdometryConfig((0.0, 0.03)), torch.zeros(N, 2))
    before = odometry.state["errors"].clone()
    some = torch.arange(N) < 10
    odometry.restart(torch.arange(N, dtype=torch.int32) + N, some, torch.ones(N, 2))
    changed = (odometry.state["errors"] != before).any(1)
    assert changed[:10].all() and not changed[10:].any() and (odometry.state["estimate"][:10, :2] == 1).all()
    assert math.isclose(before[:, 0].max().item(), 1.03, abs_tol=2e-4)
    with pytest.raises(InputError, match=r"odometry\.drift"):
        OdometryConfig((0.02, 0.01))
