"""Robots that do not come on are turned away; those that do are left alone."""

from __future__ import annotations

import numpy as np

from vinl.chain.navigators.recovery import Recovery

RATE, SPEED = 1.0, 0.5


def drive(
    recovery: Recovery, poses: np.ndarray, choice: np.ndarray, room: bool = True
) -> tuple[np.ndarray, np.ndarray]:
    """Choices and who is freed, over time, for given poses (t, n, 3) and one choice (n, 2). Where there is room robots
    that are told to turn on the spot do so."""
    out, turned = [], np.zeros(poses.shape[1])
    for pose in poses:
        shown = pose + np.stack([0 * turned, 0 * turned, turned], 1)
        out.append(recovery.correct(shown, choice))
        turned += room * 0.5 * np.where(out[-1][0][:, 0] == 0, out[-1][0][:, 1], 0.0)
    return np.array([c for c, _ in out]), np.array([f for _, f in out])


def test_a_robot_that_moves_or_turns_is_left_alone() -> None:
    t = np.arange(40.0)
    walking = np.stack([0.05 * t, 0 * t, 0 * t], 1)
    turning = np.stack([0 * t, 0 * t, 0.06 * t], 1)
    choice = np.array([[0.1, 0.0], [0.0, 0.12]])
    out, freed = drive(Recovery(2, SPEED, RATE), np.stack([walking, turning], 1), choice)
    assert not freed.any() and (out == choice).all()


def phases(out: np.ndarray, freed: np.ndarray) -> list[tuple[str, int, float]]:
    """What a robot was made to do: back, turn or walk, for how many decisions, and the yaw rate."""
    found: list[tuple[str, int, float]] = []
    for (speed, rate), is_freed in zip(out, freed, strict=True):
        name = "own" if not is_freed else "back" if speed < 0 else "turn" if rate else "walk"
        if found and found[-1][0] == name:
            found[-1] = (name, found[-1][1] + 1, found[-1][2])
        else:
            found.append((name, 1, float(rate)))
    return found


def test_a_stuck_robot_backs_up_turns_away_and_walks_and_longer_to_the_other_side_next_time() -> None:
    poses = np.tile([[1.0, 2.0, 3.1]], (80, 1, 1))
    poses[::2, 0, 2] = -3.1  # yaw wraps: that is no turn
    choice = np.array([[0.6, 0.2]])
    out, freed = drive(Recovery(1, SPEED, RATE), poses, choice)
    done = phases(out[:, 0], freed[:, 0])
    assert done[:4] == [("own", 6, 0.2), ("back", 2, 0.0), ("turn", 2, -RATE), ("walk", 2, 0.0)]
    # six decisions of its own between two tries
    assert done[4:8] == [("own", 6, 0.2), ("back", 4, 0.0), ("turn", 4, RATE), ("walk", 4, 0.0)]
    assert done[8:12] == [("own", 6, 0.2), ("back", 6, 0.0), ("turn", 6, -RATE), ("walk", 6, 0.0)]
    assert (out[~freed[:, 0]] == choice).all() and set(out[freed[:, 0], 0, 0]) == {-0.3, 0.0, SPEED}


def test_one_that_had_no_room_to_turn_does_not_walk_into_the_same_place_again() -> None:
    poses = np.tile([[1.0, 2.0, 0.0]], (40, 1, 1))
    out, freed = drive(Recovery(1, SPEED, RATE), poses, np.array([[0.6, 0.2]]), room=False)
    done = phases(out[:, 0], freed[:, 0])
    assert done[:3] == [("own", 6, 0.2), ("back", 2, 0.0), ("turn", 2, -RATE)]
    assert done[3:6] == [("own", 6, 0.2), ("back", 4, 0.0), ("turn", 4, RATE)]


def test_one_that_is_stuck_elsewhere_starts_anew_and_robots_do_not_share_their_past() -> None:
    choice = np.array([[0.6, -0.2], [0.6, -0.2]])
    poses = np.zeros((60, 2, 3))
    poses[:, 1, 0] = np.arange(60) * 0.3  # never stuck
    poses[12:20, 0, 0] = np.linspace(0.3, 2.0, 8)  # comes free after the first try
    poses[20:, 0, 0] = 2.0
    out, freed = drive(Recovery(2, SPEED, RATE), poses, choice)
    assert not freed[:, 1].any()
    done = [phase for phase in phases(out[:, 0], freed[:, 0]) if phase[0] != "own"]
    assert done[:3] == done[3:6] == [("back", 2, 0.0), ("turn", 2, RATE), ("walk", 2, 0.0)]


def test_one_that_comes_back_to_where_it_was_stuck_is_taken_away_for_longer() -> None:
    poses = np.zeros((60, 1, 3))
    poses[12:20, 0, 0] = [0.5, 1.0, 1.5, 2.0, 2.0, 1.5, 1.0, 0.5]
    out, freed = drive(Recovery(1, SPEED, RATE), poses, np.array([[0.6, -0.2]]))
    done = [phase for phase in phases(out[:, 0], freed[:, 0]) if phase[0] != "own"]
    assert done[:6] == [
        (name, n, rate)
        for n, side in ((2, RATE), (4, -RATE))
        for name, rate in (("back", 0.0), ("turn", side), ("walk", 0.0))
    ]
