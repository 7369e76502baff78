"""A small home, policies that hardly walk and the record of an episode, for all tests of the chain; a pytest plugin."""

import numpy as np
import pytest
import torch

from vinl.chain.records import EpisodeRecord
from vinl.policies.card import locomotion_card
from vinl.policies.networks import StepActor
from vinl.policies.policy import LocomotionPolicy
from vinl.world.boxes import Boxes
from vinl.world.floorplan import FloorPlan, assemble_floorplan, frame_around

RECORD = EpisodeRecord(
    plan="home", episode=0, seed=0, start=(0.0, 0.0), goal=(5.0, 0.0), yaw=0.0, straight_m=5.0, geodesic_m=6.0,
    blocks=3, success=True, end_reason="success", fell=False, time_s=10.0, distance_m=8.0, spl=0.75, soft_spl=0.75,
    foot_steps=16, foot_block_steps=12, foot_wall_steps=8, leg_contact_steps=4, trunk_contact_steps=0,
    paper_foot_steps=24, speed_rmse=0.1, yaw_rate_rmse=0.2,
)  # fmt: skip


@pytest.fixture(scope="session")
def two_rooms() -> FloorPlan:
    """Two rooms of 4.5 m x 6 m with a door of 0.9 m between them, and a table in the first."""
    w, h, t = 9.0, 6.0, 0.1
    walls = [[w / 2, y, 0, w + t, t, 0, 2.5] for y in (0, h)]
    walls += [[x, h / 2, 0, t, h + t, 0, 2.5] for x in (0, w)]
    walls += [[w / 2, y, 0, t, h / 2 - 0.45, 0, 2.5] for y in (h / 4 - 0.225, 3 * h / 4 + 0.225)]
    frame = frame_around(np.zeros(2), np.array([w, h]), "two_rooms")
    xs, ys = frame.centres()
    inside = np.outer((ys > 0) & (ys < h), (xs > 0) & (xs < w))
    table = Boxes(np.array([[2.0, 1.0, 0, 1.0, 0.6, 0, 0.8]]))
    return assemble_floorplan("two_rooms", "test", Boxes(np.array(walls)), table, inside, frame)


def small_network() -> StepActor:
    """With layers of 8 a row's place in the batch would matter to the last bits (AMD EPYC, torch 2.13)."""
    return StepActor(actor=(16,))


@pytest.fixture(scope="session")
def standing() -> LocomotionPolicy:
    """A policy whose action is always zero."""
    network = small_network()
    with torch.no_grad():
        for parameter in network.parameters():
            parameter.zero_()
    return LocomotionPolicy(network, locomotion_card("standing", network.describe(), gait={}))


@pytest.fixture(scope="session")
def trotting() -> LocomotionPolicy:
    """An untrained policy: it moves its legs somehow, so that two runs have something to agree on."""
    torch.manual_seed(0)
    network = small_network()
    return LocomotionPolicy(network, locomotion_card("trotting", network.describe(), gait={}))
