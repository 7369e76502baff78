"""Cameras and odometry with errors, in the chain: late, askew and drifting by as much as drawn; an episode's errors are
its own, whoever else is run with it."""

import json
from dataclasses import replace

import numpy as np
import pytest
import torch

from vinl.chain.config import EvaluationConfig
from vinl.chain.controller import LocomotionController
from vinl.chain.depth_cameras import CameraErrors, RealCameras, open_depth_cameras
from vinl.chain.episode import draw_routes, draw_setups
from vinl.chain.navigators.learned import DeadReckoning
from vinl.chain.navigators.oracle import OracleNavigator
from vinl.chain.rollout import run_episodes
from vinl.cli.app import main
from vinl.policies.card import locomotion_card
from vinl.policies.io import load_policy
from vinl.robot.aliengo import home_qpos
from vinl.robot.cameras import NAVIGATION_CAMERA
from vinl.sensing.sensor_config import OdometryConfig, SensorConfig, load_sensors
from vinl.world.boxes import Blocks
from vinl.world.clutter import CLUTTER
from vinl.world.floorplan import FloorPlan

CAMERA = replace(NAVIGATION_CAMERA, width=40, height=24, missing="fill")


def put_on(plan: FloorPlan, config: SensorConfig, keys: list[int], walked: np.ndarray) -> RealCameras:
    """The cameras of robots that went through the poses (steps, n, 19)."""
    errors = CameraErrors(config, keys)
    cameras = errors.put_on(open_depth_cameras(plan, [Blocks.empty()] * len(keys), CAMERA))
    for qpos in walked:
        errors.note(qpos)
    return cameras


def look(plan: FloorPlan, config: SensorConfig, keys: list[int], walked: np.ndarray) -> torch.Tensor:
    """What these cameras give."""
    return put_on(plan, config, keys, walked).look(walked[-1]).clone()


def walk(n: int, steps: int = 6) -> np.ndarray:
    return np.stack([[home_qpos(3.0 + 0.05 * k, 3.0, 0.38, 0.02 * k) for _ in range(n)] for k in range(steps)])


def test_images_are_as_old_as_drawn(two_rooms: FloorPlan) -> None:
    poses = walk(2)
    late = look(two_rooms, SensorConfig(delay=(0.06, 0.06)), [3, 4], poses)
    ideal = open_depth_cameras(two_rooms, [Blocks.empty()] * 2, CAMERA)
    torch.testing.assert_close(late, ideal.look(poses[-4]), atol=1e-5, rtol=0)
    assert not torch.allclose(late, ideal.look(poses[-1]), atol=1e-3)


class Listening:
    """Keeps what it is told of the images."""

    card, camera = locomotion_card("listening", {"class": "none"}), CAMERA

    def __init__(self, dates_images: bool) -> None:
        self.dates_images, self.told = dates_images, []

    def reset(self, which: int) -> None: ...

    def act(self, observation: np.ndarray, depth: torch.Tensor, *age: np.ndarray) -> np.ndarray:
        self.told.append(age)
        return np.zeros((len(observation), 12), np.float32)


def test_a_policy_that_dates_images_is_told_how_old_they_are(two_rooms: FloorPlan) -> None:
    poses, still = walk(6), (np.zeros((6, 18)), np.zeros((6, 3)))
    late = put_on(two_rooms, SensorConfig(delay=(0.02, 0.06)), list(range(6)), poses)
    prompt = open_depth_cameras(two_rooms, [Blocks.empty()] * 6, CAMERA)
    for cameras, ages in ((late, late._sensor.drawn["delay"].numpy()), (prompt, np.zeros(6))):
        for policy in (Listening(True), Listening(False)):
            controller = LocomotionController(policy, cameras)
            controller.reset(6)
            controller.step(poses[-1], *still)
            assert len(policy.told[0]) == policy.dates_images
            if policy.dates_images:
                np.testing.assert_allclose(policy.told[0][0], ages, atol=0.0101)  # to half a control step
    assert 0 < np.ptp(late.age) <= 0.04


def test_a_mount_that_is_off_moves_the_image(two_rooms: FloorPlan) -> None:
    poses = walk(8, 1)
    errors = CameraErrors(SensorConfig(roll=(-0.03, 0.03), pitch=(-0.03, 0.03), height=(-0.02, 0.02)), list(range(8)))
    cameras = errors.put_on(open_depth_cameras(two_rooms, [Blocks.empty()] * 8, CAMERA))
    roll, pitch, height = cameras._sensor.drawn["offset"].double().numpy().T
    errors.note(poses[0])
    seen = cameras.look(poses[0])
    for k in range(8):
        c, s = np.cos(roll[k]), np.sin(roll[k])
        assert len({roll[k], pitch[k], height[k]}) == 3 and np.allclose(
            cameras._turned[k][2, 1:], [s * np.cos(pitch[k]), c * np.cos(pitch[k])]
        )
        askew = replace(CAMERA, pitch_down=CAMERA.pitch_down + pitch[k])
        pose = poses[0, k : k + 1].copy()
        pose[:, 2] += height[k]
        level = open_depth_cameras(two_rooms, [Blocks.empty()], askew).look(pose)
        assert (seen[k] - level[0]).abs().median() < 0.05  # but for the roll
    down = look(two_rooms, SensorConfig(pitch=(0.04, 0.04)), [5], poses[:, :1])
    lowered = open_depth_cameras(two_rooms, [Blocks.empty()], replace(CAMERA, pitch_down=CAMERA.pitch_down + 0.04))
    torch.testing.assert_close(down, lowered.look(poses[0, :1]), atol=1e-4, rtol=1e-4)


def test_errors_are_the_episodes_own(two_rooms: FloorPlan) -> None:
    config, poses = load_sensors("realistic"), walk(3)
    together = look(two_rooms, config, [11, 12, 13], poses)
    alone = look(two_rooms, config, [12], poses[:, 1:2])
    assert torch.equal(together[1], alone[0]) and not torch.equal(together[0], together[1])
    assert 0.01 < (together == 0).float().mean() < 0.3


def test_dead_reckoning_starts_right_and_drifts() -> None:
    reckoning = DeadReckoning(OdometryConfig((0.05, 0.05), 0.0), [1, 2, 3, 4])
    poses = [np.tile([1.0 + 0.5 * k, 2.0, 0.3], (4, 1)) for k in range(9)]
    believed = [reckoning.follow(pose) for pose in poses]
    np.testing.assert_allclose(believed[0], poses[0], atol=1e-6)
    np.testing.assert_allclose(np.abs(believed[-1][:, 0] - 5.0), 0.05 * 4.0, atol=1e-4)
    np.testing.assert_allclose(believed[-1][:, 2], 0.3, atol=1e-6)


@pytest.mark.slow
def test_the_oracle_knows_where_it_is_and_the_ideal_is_as_before(two_rooms: FloorPlan) -> None:
    config = EvaluationConfig(time_limit=2.0, min_distance=2.0)
    setups = draw_setups(two_rooms, draw_routes(two_rooms, 2, config), 0, CLUTTER["paper"], config)
    locomotor = load_policy("loco")  # on a floor without blocks its steps do not depend on what it sees

    def paths(rules: EvaluationConfig) -> list[np.ndarray]:
        return [np.asarray(e.trace.path) for e in run_episodes(two_rooms, setups, locomotor, OracleNavigator(), rules)]

    same = paths(replace(config, sensors=load_sensors("ideal"), odometry=OdometryConfig((0.2, 0.2))))
    for one, other in zip(paths(config), same, strict=True):
        np.testing.assert_array_equal(one, other)
    spoilt = paths(replace(config, sensors=load_sensors("realistic")))
    assert any(not np.array_equal(one, other) for one, other in zip(same, spoilt, strict=True))


@pytest.mark.parametrize(("option", "value"), [("--sensors", "perfect"), ("--drift", "0.9")])
def test_bad_errors_are_one_line(option, value, capsys, tmp_path) -> None:
    assert main(["eval", "--out", str(tmp_path / "out"), option, value]) == 2
    assert len(capsys.readouterr().err.strip().splitlines()) == 1


def test_results_say_which_errors_there_were(tmp_path) -> None:
    out, options = tmp_path / "out", ["--episodes", "1", "--seeds", "1", "--workers", "1", "--set", "time_limit=0.1"]
    plan = ["--floorplans", "harbour_flat", "--loco", "blind"]
    assert main(["eval", "--out", str(out), *plan, *options, "--sensors", "realistic", "--drift", "0.02"]) == 0
    rules = json.loads((out / "results.json").read_text())["config"]["evaluation"]
    assert rules["sensors"]["noise"] == 0.01 and rules["odometry"]["drift"] == [0.02, 0.02]
