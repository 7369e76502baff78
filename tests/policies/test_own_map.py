"""The policy's own map: its trail by its motion, walls by its camera, the same whether steps come one by one or all at
once; part of the memory of a policy that is saved, loaded and trained."""

import math

import pytest
import torch

from vinl.policies.depth_policy import DepthPolicy
from vinl.policies.nav_actor import NavActor
from vinl.policies.own_map import MapGeometry, blank_map, update_map
from vinl.policies.places import VIEW

GEOMETRY = MapGeometry(0.0, 1.0, math.pi / 3, 0.5, math.pi / 2, 0.0, 10.0, 0.3, 0.4)
NONE = torch.tensor([False])


def drive(motions: list[tuple[float, float]], depth: torch.Tensor | None = None) -> tuple[torch.Tensor, torch.Tensor]:
    seen, state = update_map(blank_map(1), torch.zeros(1, 2), depth, torch.tensor([True]), GEOMETRY)
    for motion in motions:
        seen, state = update_map(state, torch.tensor([motion]), depth, NONE, GEOMETRY)
    return seen.reshape(2, VIEW, VIEW), state[0]


def test_its_trail_follows_its_motion():
    (visited, solid), state = drive([(1.0, 0.0)] * 4)  # 2 m straight on
    assert state[:3].tolist() == pytest.approx([2.0, 0.0, 0.0], abs=1e-5)
    middle = VIEW // 2
    assert (visited[middle : middle + 3, middle] > 0.9).all() and visited[:middle].sum() == 0 and solid.sum() == 0
    _, state = drive([(1.0, 1.0)] * 12)  # a full circle at 60 deg/s
    assert state[:2].norm() < 0.1 and state[2].item() == pytest.approx(2 * math.pi, abs=1e-4)
    _, state = drive([(-1.0, 0.0)] * 5)  # it stood
    assert state[:3].abs().max() == 0.0


def test_walls_are_solid_and_the_floor_is_not():
    wall = torch.full((1, 60, 80), 0.22)  # 2.2 m ahead, from floor to ceiling
    (_, solid), _ = drive([], wall)
    middle = VIEW // 2
    assert solid[middle - 2, middle] == 1.0 and solid[middle - 1 :].sum() == 0  # 2.5 m ahead of its middle, none nearer
    up = math.tan(math.pi / 4) * 0.75 * (1 - (2 * torch.arange(60) + 1) / 60)
    floor = torch.where(up < 0, -0.4 / up.clamp(max=-1e-3), 10.0).clamp(max=10.0)[None, :, None].expand(1, 60, 80) / 10
    (_, solid), _ = drive([], floor)
    assert solid.sum() == 0
    (_, solid), _ = drive([], torch.full((1, 60, 80), -1.0))  # nothing returned
    assert solid.sum() == 0


def make_actor() -> NavActor:
    torch.manual_seed(0)
    return NavActor("cnn", 24, 32, 8, 4, 16, 1, previous=4, places=GEOMETRY.describe())


def test_step_by_step_or_all_at_once_is_the_same():
    actor = make_actor()
    depth, vector = torch.rand(6, 3, 24, 32), torch.rand(6, 3, 7) * 2 - 1
    fresh = torch.zeros(6, 3, dtype=torch.bool)
    fresh[0], fresh[3, 1] = True, True
    whole, last = actor(depth, vector, actor.initial_state(3), fresh)
    state, parts = actor.initial_state(3), []
    for t in range(6):
        action, state = actor(depth[t : t + 1], vector[t : t + 1], state, fresh[t : t + 1])
        parts.append(action)
    torch.testing.assert_close(whole, torch.cat(parts))
    for one, other in zip(last, state, strict=True):
        torch.testing.assert_close(one, other)
    assert len(last) == 3 and last[2].shape[:2] == (1, 3) and not last[2].requires_grad


def test_the_card_carries_it(tmp_path):
    from vinl.policies.card import navigation_card
    from vinl.policies.io import load_policy, save_policy
    from vinl.robot.cameras import Camera

    actor = make_actor()
    camera = Camera("navigation", (0.3, 0.0, 0.0), 0.0, math.pi / 2, 32, 24, 10.0, "fill")
    save_policy(tmp_path / "own", actor, navigation_card("own", actor.describe(), camera.describe(), "both"))
    policy = load_policy(tmp_path / "own")
    assert isinstance(policy, DepthPolicy) and policy.network.geometry == GEOMETRY
    depth, vector = torch.rand(2, 24, 32) * 9 + 0.5, torch.rand(2, 7)
    first = policy.act(vector, depth)
    assert not torch.equal(first, policy.act(vector, depth))
    policy.reset(2)
    torch.testing.assert_close(policy.act(vector, depth), first)
