"""The motion that a gait asks for: kinematics, weight, symmetry, and a walk of some steps without anything learned."""

from dataclasses import asdict

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from vinl.courses.crossing import BarConfig, build_corridor, cross_bar
from vinl.gait.config import GaitConfig
from vinl.gait.leg import leg_angles, leg_jacobian
from vinl.gait.observation import STEPPING_TABLE
from vinl.gait.proprioception import feet_in_trunk
from vinl.policies.card import locomotion_card
from vinl.policies.networks import StepActor
from vinl.policies.policy import LocomotionPolicy
from vinl.policies.reference import GaitReference, carry_weight
from vinl.robot.aliengo import DEFAULT_POSE, KD, KP, MASS

MIRRORED = [1, 0, 3, 2]
"""Legs of the other side."""

joints = st.tuples(
    *[x for _ in range(4) for x in (st.floats(-0.6, 0.6), st.floats(-0.4, 2.0), st.floats(-2.4, -0.7))]
).map(np.array)


@given(joints)
def test_joint_angles_bring_the_feet_back_where_they_were(angles: np.ndarray) -> None:
    feet = feet_in_trunk(np, angles[None])
    np.testing.assert_allclose(feet_in_trunk(np, leg_angles(np, feet)), feet, atol=1e-5)


@given(joints)
def test_the_jacobian_is_the_slope_of_the_kinematics(angles: np.ndarray) -> None:
    slope = leg_jacobian(np, angles[None])[0]
    for k in range(3):
        step = np.zeros((1, 12))
        step[:, k::3] = 1e-5
        change = feet_in_trunk(np, angles + step) - feet_in_trunk(np, angles - step)
        np.testing.assert_allclose(slope[..., k], change[0] / 2e-5, atol=1e-5)


def test_feet_out_of_reach_are_neared_along_the_leg() -> None:
    feet = feet_in_trunk(np, DEFAULT_POSE[None])
    far = feet.copy()
    far[..., 2] -= 0.3
    found = feet_in_trunk(np, leg_angles(np, far))
    assert (found[..., 2] < feet[..., 2]).all() and np.isfinite(found).all()


def test_feet_that_stand_carry_the_weight_without_a_moment() -> None:
    feet = torch.tensor([[[0.3, 0.14, -0.4], [0.2, -0.14, -0.4], [-0.2, 0.14, -0.4], [-0.3, -0.14, -0.4]]])
    for loaded in ([1.0, 1, 1, 1], [1, 0, 0, 1], [0, 1, 1, 1]):
        push = carry_weight(feet, torch.tensor([loaded], dtype=torch.float32))[0]
        assert push.sum() == pytest.approx(MASS * 9.81, rel=0.02)
        assert (push[torch.tensor(loaded) == 0] == 0).all()
        assert (push[:, None] * feet[0, :, :2]).sum(0).abs().max() < 0.03 * MASS * 9.81


def test_a_robot_in_a_mirror_moves_as_in_a_mirror() -> None:
    torch.manual_seed(0)
    place = STEPPING_TABLE.place
    seen = 0.1 * torch.randn(6, STEPPING_TABLE.size)
    seen[:, place("projected_gravity")] = torch.tensor([0.05, -0.1, -1.0])
    for name in ("swing", "swing_ahead", "load_ahead"):
        seen[:, place(name)] = torch.tensor([1.0, 0, 0, 1])
    other = seen.clone()
    signs = {"base_linear_velocity": (1, -1, 1), "base_angular_velocity": (-1, 1, -1), "projected_gravity": (1, -1, 1)}
    for name, sign in {**signs, "command": (1, -1, -1), "missed": (1, -1)}.items():
        other[:, place(name)] = seen[:, place(name)] * torch.tensor(sign)
    of_legs = {"joint_position": (-1, 1, 1), "path_error": (1, -1, 1), "path_ahead": (1, -1, 1), "swing": (1,)}
    for name, sign in {**of_legs, "swing_ahead": (1,), "load_ahead": (1,)}.items():
        each = seen[:, place(name)].reshape(6, 4, -1)
        other[:, place(name)] = (each[:, MIRRORED] * torch.tensor(sign)).flatten(1)
    reference = GaitReference(GaitConfig())
    expected = reference(seen).reshape(6, 4, 3)[:, MIRRORED] * torch.tensor([-1, 1, 1])
    torch.testing.assert_close(reference(other), expected.flatten(1), atol=1e-5, rtol=0)


def test_alone_it_walks_for_some_steps() -> None:
    """Nothing is learned: without balance robots fall in the end, but they have stepped out, on all four legs."""
    network = StepActor(actor=(8,))
    for parameter in network.parameters():
        parameter.data.zero_()
    card = locomotion_card("reference", network.describe(), scan=False, gait=asdict(GaitConfig()))
    bar = BarConfig(0.01, 0.02, 0.4, 0, KP, KD)
    crossings = cross_bar(LocomotionPolicy(network, card), bar, build_corridor(bar), range(4))
    ways = [c.trace.qpos[-1, 0] - c.trace.qpos[0, 0] for c in crossings]
    seconds = [c.record.time_s for c in crossings]
    assert min(ways) > 0.3 and min(seconds) > 1.5, (ways, seconds)
