"""Robots in homes: motion, reward, ends, restarts, repetition."""

import math
from dataclasses import replace

import pytest
import torch

from vinl.config.errors import InputError
from vinl.nav.config import EpisodeConfig, ExecutionConfig, NavRewardConfig
from vinl.nav.environment import NavEnvironment
from vinl.policies.velocity_range import VelocityRange
from vinl.sensing.sensor_config import OdometryConfig


def test_steps_are_well_formed(config, homes):
    environment = NavEnvironment(config, homes)
    depth, vector = environment.observe()
    assert depth.shape == (32, 12, 16) and depth.dtype == torch.float16 and vector.shape == (32, 7)
    assert (vector[:, 3:] == 0).all()
    for _ in range(20):
        action = torch.rand(32, 2) * 3 - 1.5
        step = environment.step(action)
        assert all(torch.isfinite(x.float()).all() for x in step)
        assert step.depth.min() >= 0 and step.depth.max() <= 1
        going = ~step.done
        moved = going & (environment.state["in_a_row"] == 0)
        torch.testing.assert_close(step.vector[moved, -2:], action[moved].clamp(-1, 1))
        torch.testing.assert_close(step.vector[:, 1:3].norm(dim=1), torch.ones(32))
    measures = environment.read_measures()
    assert measures["blocked"] > 0 and measures["unplaced"] == 0


def test_same_seed_same_episodes(config, homes):
    def run(seed):
        environment = NavEnvironment(config, homes, seed=seed)
        generator = torch.Generator().manual_seed(0)
        steps = [environment.step(torch.rand(32, 2, generator=generator) * 2 - 1) for _ in range(6)]
        return torch.stack([s.depth.float().sum() + s.vector.sum() + s.reward.sum() for s in steps])

    first = run(3)
    assert (first == run(3)).all()
    assert (first != run(4)).any()


def test_goes_on_from_a_saved_state(config, homes):
    environment, other = NavEnvironment(config, homes, seed=3), NavEnvironment(config, homes, seed=4)
    action = torch.full((32, 2), 0.3)
    environment.step(action)
    other.load_state(environment.save_state())
    for a, b in zip(environment.step(action), other.step(action), strict=True):
        assert (a == b).all()
    with pytest.raises(InputError, match="not 8"):
        NavEnvironment(replace(config, num_envs=8), homes).load_state(environment.save_state())


def test_starts_lie_within_the_range(config, homes):
    config = replace(config, num_envs=500, episodes=EpisodeConfig(distance=(4.0, 6.0)), camera=None)
    environment = NavEnvironment(config, homes)
    assert environment.distance.min() >= 4.0 and environment.distance.max() <= 6.0
    still = environment.step(torch.tensor([[-1.0, 0.0]]).expand(500, 2))
    assert still.depth.shape == (500, 0, 0)
    assert environment.read_measures()["blocked"] == 0


def test_time_runs_out(config, homes):
    config = replace(config, episodes=EpisodeConfig(distance=(3.0, 30.0), steps=5), camera=None)
    environment = NavEnvironment(config, homes)
    for k in range(5):
        step = environment.step(torch.tensor([[-1.0, 0.5]]).expand(32, 2))
        assert step.done.all() == step.timeout.all() == (k == 4)
    measures = environment.read_measures()
    assert measures["episodes"] == 32 and measures["success"] == 0 and measures["steps"] == 5


@pytest.mark.parametrize("previous", ["motion", "action", "both"])
def test_a_cancelled_step_is_seen_unless_the_paper_asks(config, homes, previous):
    """A robot that asks for the same step again and again sees that it stands."""
    environment = NavEnvironment(replace(config, num_envs=300, camera=None, previous=previous), homes)
    action = torch.tensor([[0.6, 0.2]]).expand(300, 2)
    for _ in range(12):
        step = environment.step(action)
    stopped = (environment.state["in_a_row"] > 0) & ~step.done
    going = (environment.state["in_a_row"] == 0) & ~step.done
    assert stopped.sum() > 50 and going.sum() > 5
    seen = torch.tensor([-1.0, 0.0] if previous != "action" else [0.6, 0.2])
    torch.testing.assert_close(step.vector[stopped, -2:], seen.expand(int(stopped.sum()), 2))
    torch.testing.assert_close(step.vector[going, -2:], action[going])
    assert step.vector.shape == (300, 7 if previous == "both" else 5)
    if previous == "both":
        torch.testing.assert_close(step.vector[~step.done, 3:5], action[~step.done])
    assert (step.vector[step.done, 3:] == 0).all()


def test_steps_add_up_to_where_odometry_takes_the_robot_to_be(config, homes):
    drifts = OdometryConfig(drift=(0.03, 0.03), yaw_bias=0.1)
    environment = NavEnvironment(
        replace(config, num_envs=100, camera=None, previous="step", odometry=drifts), homes, seed=1
    )
    began = torch.cat([environment.state["position"], environment.state["yaw"][:, None]], 1).clone()
    believed, over = began.clone(), torch.zeros(100, dtype=torch.bool)
    assert not environment.observe()[1][:, 3:].any()
    for k in range(8):
        action = torch.tensor([[0.6, 0.4 * (-1) ** k]]).expand(100, 2)
        step = environment.step(action)
        over |= step.done
        torch.testing.assert_close(step.vector[~step.done, 3:5], action[~step.done])
        x, y, turn = step.vector[:, 5:].unbind(1)
        c, s = believed[:, 2].cos(), believed[:, 2].sin()
        believed = believed + torch.stack([c * x - s * y, s * x + c * y, turn], 1)
    estimate = environment.state["odometry_estimate"]
    torch.testing.assert_close(believed[~over, :2], estimate[~over, :2], atol=1e-4, rtol=0)
    moved = (environment.state["position"] - began[:, :2]).norm(dim=1)
    assert (moved[~over] > 1).sum() > 20
    assert ((believed[:, :2] - environment.state["position"]).norm(dim=1) > 0.02 * moved)[~over & (moved > 1)].all()


def test_a_robot_that_pushes_against_a_wall_measures_how_its_legs_sway(config, homes):
    execution = ExecutionConfig(stopped_noise=0.1)
    environment = NavEnvironment(
        replace(config, num_envs=300, camera=None, previous="both", execution=execution), homes
    )
    for _ in range(12):
        step = environment.step(torch.tensor([[1.0, 0.0]]).expand(300, 2))
    stopped = (environment.state["in_a_row"] > 0) & ~step.done
    speed = (step.vector[stopped, -2] + 1) / 2 * config.robot.max_speed
    assert stopped.sum() > 50
    # backwards reads as standing: half of a normal distribution
    assert 0.4 < (speed > 0).float().mean() < 0.6
    assert speed.square().mean().sqrt().item() == pytest.approx(0.1 / math.sqrt(2), rel=0.2)
    assert (environment.state["twist"][stopped, :2] == 0).all()


@pytest.mark.parametrize("lowest", [0.0, -0.3])
def test_the_motion_seen_is_what_the_poses_say(config, homes, lowest):
    """The chain measures the same from the poses of the robot's trunk (``vinl.chain.navigators.learned``)."""
    from vinl.chain.navigators.learned import measure_twist

    execution = ExecutionConfig(
        speed_lag=0.1, yaw_lag=0.05, speed_gain=(0.8, 1.0), yaw_noise=0.2, speed_noise=0.1, side_slip=0.1
    )
    robot = replace(config.robot, min_speed=lowest)
    environment = NavEnvironment(replace(config, num_envs=200, camera=None, execution=execution, robot=robot), homes)

    def poses():
        return torch.cat([environment.state["position"], environment.state["yaw"][:, None]], 1).double().numpy()

    for _ in range(3):
        before = poses()
        _, done, _ = environment.advance(torch.rand(200, 2) * 2 - 1)
        twist = measure_twist(before, poses(), 0.5)
        wanted = torch.as_tensor(VelocityRange((lowest, 1.0)).action(twist[:, [0, 2]]))
        torch.testing.assert_close(environment.observe()[1][:, -2:], wanted, atol=2e-3, rtol=0)
        environment.restart(done)


def test_the_price_on_metres_counts_what_a_robot_moves(config, homes):
    free = NavRewardConfig(success=0.0, progress=0.0, slack=0.0, collision=0.0, near=0.0, scale=1.0)
    settings = replace(config, num_envs=200, camera=None, reward=replace(free, path=-0.2))
    environment = NavEnvironment(settings, homes)
    before = environment.state["position"].clone()
    step = environment.step(torch.tensor([[1.0, 0.0]]).expand(200, 2))
    moved = (environment.state["position"] - before).norm(dim=1)
    torch.testing.assert_close(step.reward[~step.done], -0.2 * moved[~step.done], atol=1e-5, rtol=0)
    assert (moved[~step.done] == 0).any() and moved[~step.done].max() == pytest.approx(0.5, abs=1e-3)
