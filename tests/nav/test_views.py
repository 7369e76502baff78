"""What the robots see, held to the depth camera; the reward, held to its formula."""

import math
from dataclasses import replace

import numpy as np
import pytest
import torch

from vinl.nav.config import EpisodeConfig, ExecutionConfig, MotionConfig, NavCameraConfig, NavRewardConfig, ViewConfig
from vinl.nav.environment import NavEnvironment
from vinl.sensing.depth import DepthCamera
from vinl.sensing.sensor_config import OdometryConfig, SensorConfig
from vinl.world.mesh import floorplan_mesh
from vinl.world.readers import load_floorplan

PLANS = ("harbour_flat", "old_town")


@pytest.mark.parametrize("pitch", [0.0, -0.26])
def test_images_are_those_of_the_depth_camera(config, homes, pitch):
    lens = NavCameraConfig(width=16, height=12, pitch_down=pitch)
    config = replace(config, camera=lens, view=ViewConfig(ceiling_share=1.0, ceiling=(2.7, 2.7)))
    environment = NavEnvironment(config, homes)
    depth, _ = environment.observe()
    state = environment.state
    meshes = [floorplan_mesh(load_floorplan(name), ceiling=2.7) for name in PLANS]
    camera = DepthCamera(meshes, lens.record())
    yaw = state["yaw"].double().numpy()
    c, s, zero, one = np.cos(yaw), np.sin(yaw), np.zeros(32), np.ones(32)
    rotation = np.stack([c, -s, zero, s, c, zero, zero, zero, one], -1).reshape(32, 3, 3)
    trunk = np.column_stack([state["position"].numpy(), np.full(32, 0.36)])
    expected = lens.record().normalise(camera.render(state["home"].numpy(), trunk, rotation))
    close = (depth.float() - expected).abs() < 2e-3
    assert close.float().mean() > 0.995  # a ray along an edge may see either side


def test_camera_moves_as_told(config, homes):
    def look(**motion):
        settings = replace(config, num_envs=400, motion=MotionConfig(**motion))
        environment = NavEnvironment(settings, homes)
        environment.observe()
        return environment._camera_pose[0].clone(), environment._camera_pose[1][:, 2, 0].asin(), environment

    place, pitch, _ = look()
    assert pitch.abs().max() < 1e-6 and (place[:, 2] - 0.36).abs().max() < 1e-6
    _, pitch, environment = look(shake=(0.0, 0.05))
    assert pitch.std().item() == pytest.approx(0.05, rel=0.15)
    environment.step(torch.zeros(400, 2))
    environment.observe()
    assert np.corrcoef(pitch, environment._camera_pose[1][:, 2, 0].asin())[0, 1] < 0.3
    place, pitch, environment = look(offset=(0.0, 0.07), height_offset=0.03)
    assert 0.06 < pitch.abs().max() <= 0.0701
    # pitched up by the trunk, a camera 0.35 m ahead rises
    assert (place[:, 2] - 0.36 - 0.32 * pitch.sin()).abs().max() < 0.0301
    step = environment.step(torch.tensor([[-1.0, 0.0]]).expand(400, 2))
    environment.observe()
    kept = ~step.done
    torch.testing.assert_close(environment._camera_pose[1][kept, 2, 0].asin(), pitch[kept], atol=1e-5, rtol=0)
    place, pitch, _ = look(uniform=math.pi / 6, with_trunk=False)
    assert pitch.std().item() == pytest.approx(math.pi / 6 / math.sqrt(3), rel=0.1)
    assert (place[:, 2] - 0.36).abs().max() < 1e-6


def test_sway_keeps_on_and_differs_between_episodes(config, homes):
    """Within an episode neighbouring steps are alike; the amplitude is the episode's; draws know nothing of each
    other."""
    motion = MotionConfig(
        tilt=(0.1, 0.02),
        offset=(0.05, 0.05),
        shake=(0.03, 0.03),
        correlation=0.6,
        amplitude=(0.0, 2.0),
        height_offset=0.02,
        height_shake=0.01,
    )
    execution = ExecutionConfig(speed_gain=(0.9, 1.1), yaw_gain=(0.9, 1.1), yaw_drift=0.1, amplitude=(0.0, 1.5))
    settings = replace(config, num_envs=2000, camera=None, motion=motion, execution=execution)
    environment = NavEnvironment(settings, homes)
    state = environment.state
    drawn = torch.cat([state["gain"], state["mount"], state["amplitude"][:, None], state["sway"]], 1).T.numpy()
    others = np.corrcoef(drawn) - np.eye(len(drawn))
    assert np.abs(others).max() < 0.12
    assert state["mount"][:, :2].mean(0).numpy() == pytest.approx([0.1, 0.02], abs=0.005)
    assert 0.0 <= state["amplitude"].min() < 0.1 and 1.9 < state["amplitude"].max() <= 2.0
    before = state["sway"].clone()
    going = ~environment.step(torch.tensor([[-1.0, 0.3]]).expand(2000, 2)).done
    pairs = torch.cat([before, state["sway"]], 1)[going].T.numpy()
    assert np.diag(np.corrcoef(pairs), 3) == pytest.approx(0.6, abs=0.06)
    assert state["sway"].std(0).numpy() == pytest.approx(1.0, abs=0.06)


@pytest.mark.parametrize("seeing", [True, False])
def test_some_robots_alone_see_what_they_see_among_all(config, homes, seeing):
    errors = SensorConfig(noise=0.02, pixels=0.05, patches=1.0, delay=(0.04, 0.04))
    settings = replace(config, sensors=errors, odometry=OdometryConfig((0.02, 0.02)))
    environment = NavEnvironment(settings if seeing else replace(settings, camera=None), homes)
    environment.step(torch.full((32, 2), 0.4))
    rows = torch.tensor([3, 30, 8], dtype=torch.int32)
    alone, among = environment.observe(rows), environment.observe()
    assert all(torch.equal(some, all_[rows]) for some, all_ in zip(alone, among, strict=True))
    assert all(torch.equal(some, all_[rows]) for some, all_ in zip(environment.observe(rows), among, strict=True))


def test_the_cameras_errors_reach_the_images(config, homes):
    def look(missing="fill", **errors):
        lens = replace(config.camera, missing=missing)
        settings = replace(config, num_envs=200, camera=lens, sensors=SensorConfig(**errors))
        environment = NavEnvironment(settings, homes)
        return environment.observe()[0].float(), environment

    clean, _ = look()
    noisy, _ = look(noise=0.01)
    middle = (clean > 0.05) & (clean < 0.6)
    error = (noisy[middle] / clean[middle] - 1.0) / clean[middle]
    assert error.std().item() == pytest.approx(0.1, rel=0.1)  # 0.01 / m x 10 m
    marked, environment = look("plane", pixels=0.2)
    assert (marked < 0).float().mean().item() == pytest.approx(0.2, abs=0.01)
    bare, _ = look("plane")
    torch.testing.assert_close(marked[marked >= 0], bare[marked >= 0])
    assert bare.max() == 1.0 and clean.max() < 1.0  # a real camera has no return from beyond its range: filled
    again = environment.step(torch.zeros(200, 2)).depth.float()
    assert not torch.equal(marked < 0, again < 0)
    filled, _ = look("fill", pixels=0.2)
    assert filled.min() > 0.0 and (filled == clean).float().mean() > 0.8
    unprepared, _ = look("as_is", pixels=0.2)
    assert torch.equal(unprepared == 1.0, (marked < 0) | (bare == 1.0))


def test_an_image_is_as_old_and_the_camera_as_askew_as_drawn(config, homes):
    settings = replace(config, num_envs=64, motion=MotionConfig())
    now = NavEnvironment(settings, homes)
    old = NavEnvironment(
        replace(settings, sensors=SensorConfig(delay=(0.25, 0.25), pitch=(-0.02, 0.02), height=(-0.01, 0.01))), homes
    )
    start = now.state["position"].clone()
    actions = torch.tensor([[0.6, 0.4]]).expand(64, 2)
    done = now.advance(actions)[1] | old.advance(actions)[1]
    eyes = []
    for environment in (now, old):
        environment.observe()
        eyes.append([part.clone() for part in environment._camera_pose])
    kept = ~done & (now._blocked == 0)
    assert kept.sum() > 20
    heading = torch.atan2(eyes[0][1][:, 1, 0], eyes[0][1][:, 0, 0]) - torch.atan2(
        eyes[1][1][:, 1, 0], eyes[1][1][:, 0, 0]
    )
    turn = torch.atan2(heading.sin(), heading.cos())[kept]
    assert turn.numpy() == pytest.approx(0.25 * 0.4 * math.pi / 3, abs=1e-4)  # half of the way back
    place = [eye[0][:, :2] - config.camera.forward * eye[1][:, :2, 0] for eye in eyes]
    back = (place[0] - place[1])[kept].norm(dim=1)
    assert back.numpy() == pytest.approx((place[0] - start)[kept].norm(dim=1).numpy() / 2, rel=0.02)
    pitch = eyes[1][1][:, 2, 0].asin()
    assert 0.01 < pitch.abs().max() <= 0.0201 and (eyes[1][0][:, 2] - 0.36).abs().max() <= 0.0101
    resting = NavEnvironment(settings, homes)
    for name in ("home", "goal", "position", "yaw", "gain", "mount", "sway"):
        assert torch.equal(resting.state[name], NavEnvironment(old.config, homes).state[name])


def test_with_drift_the_robot_believes_otherwise_but_arrives_where_the_goal_is(config, homes):
    settings = replace(
        config, num_envs=200, camera=None, previous="action", episodes=EpisodeConfig(distance=(1.0, 6.0))
    )
    exact = NavEnvironment(settings, homes)
    drifting = NavEnvironment(replace(settings, odometry=OdometryConfig((0.2, 0.2))), homes)
    apart, arrived = torch.zeros(200), 0
    for _ in range(40):
        bearing = torch.atan2(exact.observe()[1][:, 2], exact.observe()[1][:, 1])
        action = torch.stack([torch.where(bearing.abs() < 0.6, 1.0, -1.0), (bearing / 0.52).clamp(-1, 1)], 1)
        steps = [environment.advance(action) for environment in (exact, drifting)]
        for one, other in zip(*steps, strict=True):
            assert torch.equal(one, other)  # reward, end and success follow from where the robot is
        apart = torch.maximum(apart, (exact.observe()[1] - drifting.observe()[1])[:, 0].abs())
        arrived += int((steps[0][1] & ~steps[0][2]).sum())
        for environment in (exact, drifting):
            environment.restart(steps[0][1])
        torch.testing.assert_close(  # a new episode begins with the true place
            exact.observe()[1][steps[0][1]], drifting.observe()[1][steps[0][1]], atol=1e-6, rtol=0
        )
    assert arrived > 20 and 0.1 < apart.max() < 1.0


def test_reward_is_progress_and_the_goal_ends_the_episode(config, homes):
    rewards = NavRewardConfig(success=10.0, progress=1.0, slack=-0.002, collision=-0.003, near=-0.05, scale=0.2)
    config = replace(config, num_envs=200, camera=None, reward=rewards, episodes=EpisodeConfig(distance=(1.0, 6.0)))
    environment = NavEnvironment(config, homes)
    total, successes = 0.0, 0
    for _ in range(60):
        before, start = environment.distance.clone(), environment.state["start_distance"].clone()
        _, vector = environment.observe()
        # towards the goal as the crow flies
        bearing = torch.atan2(vector[:, 2], vector[:, 1])
        action = torch.stack([torch.where(bearing.abs() < 0.6, 1.0, -1.0), (bearing / 0.52).clamp(-1, 1)], 1)
        reward, done, timeout = environment.advance(action)
        ended, blocked, close = environment.ended, environment._blocked, environment._near
        success = done & ~timeout
        expected = 0.2 * (before - environment.distance - 0.002 - 0.003 * blocked - 0.05 * close + 10.0 * success)
        torch.testing.assert_close(reward, expected)
        near = (environment.goals() - environment.state["position"]).norm(dim=1)
        assert (near[success] < 0.325).all() and (ended.success[done] == success[done].float()).all()
        assert (ended.spl[done] <= 1).all() and (ended.spl[done] >= 0).all()
        torch.testing.assert_close(ended.start_distance[done], start[done])
        successes += int(success.sum())
        total += float(done.sum())
        environment.restart(done)
    assert successes > 30
    measures = environment.read_measures()
    assert measures["episodes"] == total and measures["success"] == pytest.approx(successes / total)
    reasons = measures["stuck"] + measures["looping"] + measures["out_of_time"]
    assert reasons == pytest.approx(1 - measures["success"])


def test_the_shortest_way_is_free_of_cost(config, homes):
    """Who follows the distance field makes good nearly what it moves."""
    config = replace(config, num_envs=64, camera=None, episodes=EpisodeConfig(distance=(3.0, 20.0)))
    environment = NavEnvironment(config, homes)
    before = environment.distance.clone()
    moved = environment.state["position"].clone()
    environment.advance(torch.tensor([[1.0, 0.0]]).expand(64, 2))
    way = (environment.state["position"] - moved).norm(dim=1)
    assert ((before - environment.distance).abs() <= 1.09 * way + 0.03).all()
