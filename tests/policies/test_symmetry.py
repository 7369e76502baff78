"""The mirror image of a robot is told the mirror image, and does the mirror image."""

import numpy as np
import torch

from vinl.gait.config import GaitConfig
from vinl.gait.footholds import plan_footholds
from vinl.gait.observation import STEPPING_TABLE, insert_gait, observe_gait
from vinl.gait.state import aim, feet_in_heading_frame, motion_between, start_gait, tick, velocity_in_heading_frame
from vinl.policies.networks import StepActor
from vinl.policies.symmetry import mirror_terms
from vinl.robot.aliengo import DEFAULT_POSE
from vinl.robot.observation import observe

LEGS, JOINT = np.array([1, 0, 3, 2]), np.array([-1.0, 1.0, 1.0])


def mirror_joints(x):
    return (x.reshape(-1, 4, 3)[:, LEGS] * JOINT).reshape(-1, 12)


def mirror_pose(q):
    return np.concatenate([q[:, :3] * [1, -1, 1], q[:, 3:7] * [1, -1, 1, -1], mirror_joints(q[:, 7:])], 1)


def mirror_speed(v):
    return np.concatenate([v[:, :3] * [1, -1, 1], v[:, 3:6] * [-1, 1, -1], mirror_joints(v[:, 6:])], 1)


def what_is_observed(config, poses, speed, phases, command, action):
    """Of robots after two control steps, the second of which begins with legs in given phases."""
    feet = feet_in_heading_frame(np, poses[0])
    gait = start_gait(np, config, feet)._replace(phases=phases)
    for before, after in ((poses[0], poses[1]), (poses[1], poses[2])):
        feet, velocity = feet_in_heading_frame(np, after), velocity_in_heading_frame(np, after, speed)
        gait = tick(np, config, gait, motion_between(np, before, after), command, feet)
        plan = plan_footholds(np, config, None, gait, velocity, command, feet)
        gait = aim(np, config, gait, plan, velocity, command, feet)
    plain = observe(np, poses[2], speed, command, action, None)
    return insert_gait(np, plain, observe_gait(np, config, gait, feet))


def test_a_mirrored_robot_observes_the_mirror_image() -> None:
    rng = np.random.default_rng(3)
    n, config = 20, GaitConfig()
    first = np.concatenate([rng.normal(0, 1, (n, 7)), DEFAULT_POSE + rng.normal(0, 0.2, (n, 12))], 1)
    first[:, 3:7] = [1, 0, 0, 0] + 0.3 * first[:, 3:7]
    poses = [first + k * rng.normal(0, 0.02, first.shape) for k in range(3)]
    for q in poses:
        q[:, 3:7] /= np.linalg.norm(q[:, 3:7], axis=1, keepdims=True)
    speed, command, action = (rng.normal(0, 0.5, (n, k)) for k in (18, 3, 12))
    phases = rng.uniform(0, 1, (n, 4))
    here = what_is_observed(config, poses, speed, phases, command, action)
    mirrored = [mirror_pose(q) for q in poses]
    there = what_is_observed(
        config, mirrored, mirror_speed(speed), phases[:, LEGS], command * [1, -1, -1], mirror_joints(action)
    )
    index, sign = mirror_terms(STEPPING_TABLE.terms)
    np.testing.assert_allclose(there, here[:, index] * sign, atol=1e-5)
    assert np.abs(here - there).max() > 0.1


def test_an_actor_does_the_mirror_image() -> None:
    torch.manual_seed(0)
    actor, x = StepActor(actor=[16, 8]), torch.randn(5, STEPPING_TABLE.size)
    index, sign = mirror_terms(STEPPING_TABLE.terms)
    assert sorted(index) == list(range(STEPPING_TABLE.size))
    other = actor(x[:, index] * torch.from_numpy(sign)).detach().numpy()
    np.testing.assert_allclose(other, mirror_joints(actor(x).detach().numpy()), atol=1e-6)
    assert actor(x).abs().max() > 1e-3
    assert set(actor.state_dict()) == {f"actor.{k}.{kind}" for k in (0, 2, 4) for kind in ("weight", "bias")}
