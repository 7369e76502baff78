"""Recorded motion: the figures come out that were put in, and a standing robot stands."""

import sys
from pathlib import Path

import numpy as np
import pytest

from vinl.config.errors import InputError
from vinl.policies.policy import LocomotionPolicy

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "scripts"))
from trunk_motion import (
    STEP,
    MotionRecord,
    describe_sway,
    draw_decisions,
    fit_execution,
    lag_commands,
    read_twists,
    record_motion,
)


def drive(twists: np.ndarray) -> np.ndarray:
    """Poses of a robot that moves on arcs, in thousand little steps each."""
    pose, poses = np.zeros(3), [np.zeros(3)]
    for forward, left, rate in twists:
        for _ in range(1000):
            c, s = np.cos(pose[2]), np.sin(pose[2])
            pose = pose + np.array([c * forward - s * left, s * forward + c * left, rate]) * STEP / 1000
        poses.append(pose)
    return np.array(poses)


def test_twists_are_read_back() -> None:
    twists = np.array([[1.0, 0.0, 0.0], [0.5, 0.1, 1.0], [0.0, -0.2, -1.0], [0.8, 0.0, 6.0]])
    np.testing.assert_allclose(read_twists(drive(twists)), twists, atol=2e-3)


def test_lag_gain_and_noise_are_found() -> None:
    rng, records = np.random.default_rng(0), []
    for _ in range(6):
        commands = draw_decisions(rng, 200)
        met = lag_commands(commands, 0.2) * [0.9, 0.8]
        forward = met[:, 0] * (1 + 0.05 * rng.normal(size=200))
        twists = np.stack([forward, 0.03 * rng.normal(size=200) * met[:, 0], met[:, 1]], 1)
        poses, at = [np.zeros(3)], np.zeros(3)
        for v, slip, rate in twists[:-1]:
            middle = at[2] + rate * STEP / 2
            chord = STEP * np.sinc(rate * STEP / 2 / np.pi)
            c, s = np.cos(middle), np.sin(middle)
            at = at + np.array([chord * (c * v - s * slip), chord * (s * v + c * slip), rate * STEP])
            poses.append(at)
        records.append(MotionRecord(np.array(poses), np.zeros((200, 3)), commands, False))
    found = fit_execution(records)
    assert (found.speed_lag, found.yaw_lag) == pytest.approx((0.2, 0.2), abs=0.02)
    assert (found.speed_gain, found.yaw_gain) == pytest.approx((0.9, 0.8), abs=0.01)
    assert found.speed_noise == pytest.approx(0.05 * 0.9, rel=0.3)
    assert found.side_slip == pytest.approx(0.03, rel=0.2)
    assert found.yaw_noise < 0.01 and abs(found.yaw_drift) < 0.01


def test_offset_and_motion_are_told_apart() -> None:
    rng = np.random.default_rng(0)
    records = []
    for _ in range(200):
        tilts = 0.1 * rng.normal(size=3) + 0.02 * rng.normal(size=(60, 3)) + [0.0, 0.05, 0.4]
        records.append(MotionRecord(np.zeros((60, 3)), tilts, np.zeros((60, 2)), False))
    pitch = describe_sway(records)["pitch"]
    assert (pitch.offset, pitch.within) == pytest.approx((0.1, 0.02), rel=0.15)
    assert pitch.mean == pytest.approx(0.05, abs=0.03) and abs(pitch.autocorrelation) < 0.05
    with pytest.raises(ValueError, match="long enough"):
        describe_sway([])


def test_a_command_for_every_decision() -> None:
    commands = draw_decisions(np.random.default_rng(1), 200)
    assert commands.shape == (200, 2) and (commands[:, 0] >= 0).all() and 0.5 < np.ptp(commands[:, 0]) <= 1
    assert (np.abs(commands[:, 1]) <= np.pi / 3).all() and (np.diff(commands[:, 0]) == 0).mean() > 0.5


def test_a_standing_robot_stands(standing: LocomotionPolicy) -> None:
    records = record_motion(standing, robots=2, seconds=2.0)
    assert [record.poses.shape for record in records] == [(4, 3)] * 2
    for record in records:
        assert not record.fell
        assert np.abs(record.tilts[:, :2]).max() < 0.1 and 0.3 < record.tilts[-1, 2] < 0.4
        assert np.linalg.norm(np.ptp(record.poses[:, :2], axis=0)) < 0.15
    with pytest.raises(InputError, match="'many' is not a preset"):
        record_motion(standing, "many")
