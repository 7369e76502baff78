"""Robots that do not come on are turned away; those that do are left alone."""

from __future__ import annotations

import numpy as np

from vinl.evaluation.recovery import Recovery

RATE, SPEED = 1.0, 0.5


def drive(recovery: Recovery, poses: np.ndarray, choice: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Choices and who is freed, over time, for given poses (t, n, 3) and one choice (n, 2)."""
    out = [recovery.correct(pose, choice) for pose in poses]
    return np.array([c for c, _ in out]), np.array([f for _, f in out])


def test_a_robot_that_moves_or_turns_is_left_alone() -> None:
    t = np.arange(40.0)
    walking = np.stack([0.05 * t, 0 * t, 0 * t], 1)
    turning = np.stack([0 * t, 0 * t, 0.06 * t], 1)
    choice = np.array([[0.1, 0.0], [0.0, 0.12]])
    out, freed = drive(Recovery(2, SPEED, RATE), np.stack([walking, turning], 1), choice)
    assert not freed.any() and (out == choice).all()


def test_a_stuck_robot_turns_away_then_walks_and_longer_to_the_other_side_next_time() -> None:
    poses = np.tile([[1.0, 2.0, 3.1]], (60, 1, 1))
    poses[::2, 0, 2] = -3.1  # yaw wraps: that is no turn
    choice = np.array([[0.6, 0.2]])
    out, freed = drive(Recovery(1, SPEED, RATE), poses, choice)
    assert not freed[:6].any() and freed[6, 0]
    first = np.flatnonzero(freed[:, 0])[:4]
    np.testing.assert_array_equal(first, [6, 7, 8, 9])
    np.testing.assert_array_equal(out[first, 0], [[0, -RATE], [0, -RATE], [SPEED, 0], [SPEED, 0]])
    then = np.flatnonzero(freed[:, 0] & (np.arange(60) > 9))[:6]
    assert then[0] == 16  # six decisions of its own between two tries
    np.testing.assert_array_equal(out[then, 0], [[0, RATE]] * 4 + [[SPEED, 0]] * 2)
    assert (out[~freed[:, 0]] == choice).all()


def test_one_that_came_away_starts_anew_and_robots_do_not_share_their_past() -> None:
    choice = np.array([[0.6, -0.2], [0.6, -0.2]])
    poses = np.zeros((40, 2, 3))
    poses[:, 1, 0] = np.arange(40) * 0.3  # never stuck
    poses[12:20, 0, 0] = np.linspace(0.3, 2.0, 8)  # comes free after the first try
    poses[20:, 0, 0] = 2.0
    out, freed = drive(Recovery(2, SPEED, RATE), poses, choice)
    assert not freed[:, 1].any()
    again = np.flatnonzero(freed[:, 0])
    assert (np.diff(again) > 1).sum() >= 1
    second = again[np.flatnonzero(np.diff(again) > 1)[0] + 1]
    # the first try of another place: away from where it wants to turn, for two decisions
    np.testing.assert_array_equal(out[second : second + 3, 0], [[0, RATE], [0, RATE], [SPEED, 0]])
