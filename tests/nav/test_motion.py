"""Arcs, collisions against exact geometry, imperfect execution."""

import math
from dataclasses import replace

import numpy as np
import pytest
import shapely
import torch

from vinl.nav.config import ExecutionConfig
from vinl.nav.environment import NavEnvironment
from vinl.world.boxes import Boxes
from vinl.world.floorplan import BODY_HEIGHT

N = 400


@pytest.fixture(scope="module")
def blind(config):
    return replace(config, num_envs=N, camera=None)


def scatter(homes, rng) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Slots, places and headings near the starts, at which nothing is promised."""
    home = rng.integers(len(homes), size=N)
    spots = np.stack([homes.homes.starts.numpy()[h, rng.integers(128)] for h in home])
    return home, spots + rng.uniform(-0.15, 0.15, (N, 2)), rng.uniform(-math.pi, math.pi, N)


def put(environment, home, xy, yaw):
    """Begin an episode of every robot at such a place, with the first goal of its home."""
    environment.restart()
    for name, values in (("home", home), ("goal", np.zeros(N)), ("position", xy), ("yaw", yaw)):
        environment.state[name].copy_(torch.tensor(values))


def follow_arc(xy, yaw, v, w, t):
    """The pose after t seconds at constant forward speed and yaw rate."""
    if abs(w) < 1e-9:
        return xy + v * t * np.array([math.cos(yaw), math.sin(yaw)]), yaw
    turn = np.array([math.sin(yaw + w * t) - math.sin(yaw), math.cos(yaw) - math.cos(yaw + w * t)])
    return xy + v / w * turn, yaw + w * t


def rectangles(poses, length, width):
    rows = [[*xy, yaw, length, width, 0.0, 1.0] for xy, yaw in poses]
    return shapely.polygons(Boxes(np.array(rows)).corners())


@pytest.mark.parametrize("lowest", [0.0, -0.4])
def test_moves_on_arcs_and_is_stopped_as_exact_geometry_says(blind, homes, lowest):
    rng = np.random.default_rng(0)
    environment = NavEnvironment(replace(blind, robot=replace(blind.robot, min_speed=lowest)), homes)
    home, xy, yaw = scatter(homes, rng)
    put(environment, home, xy, yaw)
    action = rng.uniform(-1, 1, (N, 2)).astype(np.float32)
    action[:5, 1] = 0.0  # straight on
    environment.advance(torch.tensor(action))
    ended = environment.ended
    assert ended is not None
    blocked, there = ended.collisions.numpy() > 0, environment.state["position"].numpy()
    low = [Boxes(r.solid[r.solid[:, 5] < BODY_HEIGHT].astype(float)) for r in homes.records]
    walls = [shapely.union_all([shapely.Polygon(c) for c in boxes.corners()]) for boxes in low]
    shapely.prepare(walls)
    judged, near_judged = 0, 0
    for k in range(N):
        v, w = lowest + (action[k, 0] + 1) / 2 * (1 - lowest), action[k, 1] * math.pi / 3
        poses = [follow_arc(xy[k], yaw[k], v, w, t) for t in np.linspace(0.02, 0.5, 25)]
        sweeps = [rectangles(poses, 0.65 + m, 0.31 + m) for m in (-0.1, 0.1)]
        surely, maybe = (shapely.intersects(walls[home[k]], sweep).any() for sweep in sweeps)
        if surely == maybe:  # what lies within 5 cm of touching is left to the grid
            judged += 1
            assert blocked[k] == surely, (k, home[k], xy[k], yaw[k], v, w)
        if not blocked[k]:
            np.testing.assert_allclose(there[k], poses[-1][0], atol=1e-4)
            assert abs(math.remainder(environment.state["yaw"][k].item() - poses[-1][1], 2 * math.pi)) < 1e-4
        else:
            np.testing.assert_allclose(there[k], xy[k], atol=1e-6)
        end = [(there[k].astype(float), environment.state["yaw"][k].item())]
        sweeps = [rectangles(end, 0.89 + m, 0.55 + m) for m in (-0.1, 0.1)]
        surely, maybe = (shapely.intersects(walls[home[k]], sweep).any() for sweep in sweeps)
        if surely == maybe:
            near_judged += 1
            assert bool(environment._near[k]) == surely, (k, home[k], there[k])
    assert judged > 0.7 * N and 0.1 < blocked.mean() < 0.9
    assert near_judged > 0.6 * N and 0.1 < environment._near.mean() < 0.95


def test_execution_lags_and_slips(blind, homes):
    def run(steps, **settings):
        config = replace(blind, execution=ExecutionConfig(**settings))
        environment = NavEnvironment(config, homes)
        moved = []
        for _ in range(steps):
            before = environment.state["path"].clone()
            done = environment.step(torch.tensor([[1.0, 0.0]]).expand(N, 2)).done
            way = environment.state["path"] - before
            moved.append(way[(environment.state["in_a_row"] == 0) & ~done & (environment.state["steps"] == _ + 1)])
        return moved

    perfect = run(2)
    torch.testing.assert_close(perfect[0], torch.full_like(perfect[0], 0.5))
    lagging = run(2, speed_lag=0.3)
    # the integral of 1 - exp(-t / 0.3) over half a second
    assert lagging[0].median().item() == pytest.approx(0.5 - 0.3 * (1 - math.exp(-0.5 / 0.3)), abs=1e-5)
    assert lagging[1].max() > lagging[0].median()
    noisy = run(1, speed_noise=0.1, speed_gain=(0.8, 0.9))
    assert noisy[0].mean() / 0.5 == pytest.approx(0.85, abs=0.03)
    assert noisy[0].std() / 0.5 == pytest.approx(math.hypot(0.1, 0.1 / math.sqrt(12)), rel=0.3)


def test_gives_way_when_it_turns_against_something(blind, homes):
    def run(give_way, held_share=0.0):
        rng = np.random.default_rng(1)
        environment = NavEnvironment(
            replace(blind, execution=ExecutionConfig(give_way=give_way, held_share=held_share)), homes
        )
        home, xy, yaw = scatter(homes, rng)
        put(environment, home, xy, yaw)
        before = environment.state["position"].clone(), environment.state["yaw"].clone()
        action = torch.tensor(rng.uniform(-1, 1, (N, 2)).astype(np.float32))
        environment.advance(action)
        assert environment.ended is not None
        turn = torch.remainder(environment.state["yaw"] - before[1] + math.pi, 2 * math.pi) - math.pi
        way = torch.linalg.vector_norm(environment.state["position"] - before[0], dim=1)
        return environment.ended.collisions > 0, way, turn, 0.5 * math.pi / 3 * action[:, 1], environment, home

    blocked, way, turn, _, _, _ = run(0.0)
    assert blocked.any() and way[blocked].max() < 1e-6 and turn[blocked].abs().max() < 1e-6
    touched, _, turned, _, _, _ = run(0.1, held_share=0.5)
    held = turned[touched].abs() < 1e-6
    assert 0.35 < held.float().mean() < 0.9  # half of the episodes, and where nothing helps
    touched, pushed, turned, told, environment, home = run(0.1)
    assert (turned[touched].abs() < 1e-6).float().mean() < held.float().mean() - 0.2
    assert torch.equal(touched, blocked)
    torch.testing.assert_close(way[~blocked], pushed[~blocked])
    assert pushed[blocked].max() < 0.1 + 1e-5
    free = turned.abs() > 1e-6
    assert (free & blocked).sum() > 0.6 * blocked.sum()
    torch.testing.assert_close(turned[free & blocked], told[free & blocked], atol=1e-4, rtol=0)
    low = [Boxes(r.solid[r.solid[:, 5] < BODY_HEIGHT].astype(float)) for r in homes.records]
    walls = [shapely.union_all([shapely.Polygon(c) for c in boxes.corners()]) for boxes in low]
    state = environment.state
    for k in torch.nonzero(free & blocked)[:, 0].tolist():
        inner = rectangles([(state["position"][k].numpy(), state["yaw"][k].item())], 0.55, 0.21)[0]
        assert not walls[home[k]].intersects(inner)
