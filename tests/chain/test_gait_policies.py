"""Policies with a gait in the chain and on the courses: what their cards list is what they are given."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import numpy as np
import pytest
import torch

from vinl.chain.controller import open_controller
from vinl.courses.evaluate import compare_locomotors
from vinl.gait.config import GaitConfig
from vinl.gait.observation import SENSED_TABLE, STEPPING_TABLE
from vinl.policies.card import locomotion_card
from vinl.policies.depth_policy import DepthPolicy
from vinl.policies.networks import PolicyNetwork, StepActor
from vinl.policies.policy import LocomotionPolicy
from vinl.policies.stepping_actor import SteppingActor
from vinl.robot.aliengo import home_qpos
from vinl.world.boxes import Blocks, Boxes
from vinl.world.floorplan import FloorPlan, assemble_floorplan
from vinl.world.grid import GridFrame

N = 2


class Listening(LocomotionPolicy):
    """Keeps what it is given."""

    seen: Any = None

    def act(self, observation: Any, depth: Any = None) -> Any:
        self.seen = observation
        return super().act(observation, depth)


def teacher() -> Listening:
    """Random weights; stands nearly still."""
    torch.manual_seed(0)
    network: PolicyNetwork = StepActor(actor=[16])
    return Listening(network, locomotion_card("steps", network.describe(), gait=asdict(GaitConfig())))


@pytest.fixture
def room() -> FloorPlan:
    """A room of 6 m x 4 m about the origin."""
    wall = Boxes(np.array([[2.9, 0.0, 0.0, 0.2, 4.0, 0.0, 2.5]]))
    frame = GridFrame(-2.975, -1.975, 0.05, (80, 120))
    return assemble_floorplan("room", "test", wall, Boxes.empty(), np.ones((80, 120), bool), frame)


def test_rows_of_the_gait_stand_behind_proprioception_and_begin_anew(room: FloorPlan) -> None:
    policy = teacher()
    controller = open_controller(policy, room, [Blocks.empty()] * N)
    controller.reset(N)
    qpos, command = np.stack([home_qpos(0.0, y) for y in (-0.5, 0.5)]), np.tile([0.5, 0.0, 0.0], (N, 1))
    qvel = np.zeros((N, 18))
    for _ in range(12):
        controller.step(qpos, qvel, command)
    swing = STEPPING_TABLE.place("swing")
    assert policy.seen.shape == (N, STEPPING_TABLE.size)
    assert policy.seen[:, swing].sum(1).tolist() == [2.0, 2.0]  # the trot has begun
    controller.reset(np.array([True, False]))
    controller.step(qpos, qvel, command)
    assert policy.seen[:, swing].sum(1).tolist() == [0.0, 2.0]


def test_a_policy_without_the_trunks_velocity_is_not_given_it(room: FloorPlan) -> None:
    network = SteppingActor(hidden=8, layers=1, actor=[8])
    card = locomotion_card("student", network.describe(), table=SENSED_TABLE)
    controller = open_controller(DepthPolicy(network, card), room, [Blocks.empty()] * N)
    controller.reset(N)
    qpos = np.stack([home_qpos(0.0, y) for y in (-0.5, 0.5)])
    moving = np.zeros((N, 18))
    moving[0, 0] = 0.7  # only the velocity of the trunk differs
    targets = controller.step(qpos, moving, np.tile([0.5, 0.0, 0.0], (N, 1)))
    np.testing.assert_allclose(targets[0], targets[1], rtol=0, atol=1e-6)  # rows round differently


def test_it_walks_on_the_courses_and_workers_change_nothing() -> None:
    results = [compare_locomotors([teacher()], "blocks", robots=2, seconds=0.4, workers=w)[0] for w in (1, 2)]
    assert results[0].aggregate == results[1].aggregate
