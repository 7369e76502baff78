"""Posts where a robot was stuck: seen as they would be if they stood there, for a while, by that robot alone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import torch
import trimesh

from vinl.chain.navigators.recovery import AHEAD, LASTS, RADIUS, StuckPlaces
from vinl.robot.cameras import NAVIGATION_CAMERA
from vinl.sensing.depth import DepthCamera

PERIOD = 0.5
CAMERA = replace(NAVIGATION_CAMERA, position=(0.33, 0.02, 0.05))
STUCK_AT = np.array([1.0, -2.0, 0.7])


def empty(n: int) -> torch.Tensor:
    return torch.full((n, CAMERA.height, CAMERA.width), CAMERA.far)


def test_a_post_is_seen_as_the_depth_camera_would_see_it() -> None:
    rng = np.random.default_rng(0)
    poses = np.column_stack([STUCK_AT[:2] + rng.uniform(-2, 2, (60, 2)), rng.uniform(-np.pi, np.pi, 60)])
    at = STUCK_AT[:2] + AHEAD * np.array([np.cos(STUCK_AT[2]), np.sin(STUCK_AT[2])])
    away = np.linalg.norm(poses[:, :2] - at, axis=1)
    poses = poses[away > RADIUS + 0.4]  # no camera within it
    places = StuckPlaces(len(poses), CAMERA, PERIOD)
    places.remember(np.ones(len(poses), bool), np.tile(STUCK_AT, (len(poses), 1)))
    seen = places.draw(poses, empty(len(poses))).numpy()

    post = trimesh.creation.cylinder(RADIUS, 40.0, sections=400)
    post.apply_translation([*at, 0.0])
    turn = np.array([[[np.cos(a), -np.sin(a), 0], [np.sin(a), np.cos(a), 0], [0, 0, 1]] for a in poses[:, 2]])
    trunk = np.column_stack([poses[:, :2], np.full(len(poses), 0.4)])
    camera = DepthCamera([(post.vertices, post.faces)], CAMERA, device="cpu")
    expected = camera.render([0] * len(poses), trunk, turn).numpy()
    off = np.abs(seen - expected) > 0.01
    assert off.mean() < 2e-3  # rays that graze the edge
    assert (expected < CAMERA.far).any((1, 2)).sum() > 5 and (expected == CAMERA.far).all((1, 2)).sum() > 5


def test_it_hides_only_what_lies_behind_it_and_does_not_change_what_was_given() -> None:
    places = StuckPlaces(2, CAMERA, PERIOD)
    near, before = empty(2), np.tile(STUCK_AT, (2, 1))
    near[:, :, ::2] = 0.05
    given = near.clone()
    assert places.draw(before, near) is near
    places.remember(np.array([True, False]), before)
    back = before - [[np.cos(STUCK_AT[2]), np.sin(STUCK_AT[2]), 0.0]]
    seen = places.draw(back, near)
    assert torch.equal(near, given) and torch.equal(seen[1], near[1])
    assert (seen[0, :, ::2] == 0.05).all() and seen[0].max() == CAMERA.far
    middle = seen[0, CAMERA.height // 2, CAMERA.width // 2 - 1 : CAMERA.width // 2 + 1].max()
    assert abs(float(middle) - (1.0 + AHEAD - RADIUS - CAMERA.position[0])) < 0.05


def test_it_is_gone_after_a_while_and_unseen_from_within() -> None:
    places = StuckPlaces(1, CAMERA, PERIOD)
    pose, ahead = STUCK_AT[None], np.array([[np.cos(STUCK_AT[2]), np.sin(STUCK_AT[2]), 0.0]])
    places.remember(np.array([True]), pose)
    within, back = pose + 0.3 * ahead, pose - ahead  # there its camera is in the post
    assert torch.equal(places.draw(within, empty(1)), empty(1))
    for _ in range(round(LASTS / PERIOD) - 2):
        assert places.draw(back, empty(1)).min() < 1.5
    assert torch.equal(places.draw(back, empty(1)), empty(1))
