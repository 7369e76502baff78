"""Gait clock, footholds and swing paths, without a simulator."""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from vinl.config.errors import InputError
from vinl.gait.clock import OFFSETS, swing_fraction, unison, wanted_period
from vinl.gait.config import GaitConfig
from vinl.gait.footholds import LEANS, obstruction, plan_footholds
from vinl.gait.gliding import glide
from vinl.gait.ground_view import FieldView, build_ground_map
from vinl.gait.leg import knee_from_foot
from vinl.gait.path import GAIT_SIZE, gait_rows, swing_path
from vinl.gait.state import (
    GaitState,
    Plan,
    aim,
    feet_in_heading_frame,
    motion_between,
    raibert,
    stance_places,
    start_gait,
    swings,
    tick,
    time_to_touch_down,
)
from vinl.robot.aliengo import CONTROL_DT, HIPS, LINK, home_qpos
from vinl.world.boxes import Boxes
from vinl.world.grid import BLOCK, GridFrame, flat_field, raise_boxes

CONFIG = GaitConfig()


def standing(n: int = 3) -> np.ndarray:
    """Feet of standing robots in the heading frame."""
    return np.concatenate([np.tile(stance_places(CONFIG), (n, 1, 1)), np.full((n, 4, 1), -0.4)], -1).astype(np.float32)


def commands(*rows: tuple[float, float, float]) -> np.ndarray:
    return np.array(rows, np.float32)


def walk(steps: int, command: np.ndarray) -> tuple[GaitState, np.ndarray]:
    """A robot that does just what it is told, on level ground."""
    feet = standing(len(command))
    gait = start_gait(np, CONFIG, feet)
    motion = np.zeros((len(command), 4), np.float32)
    motion[:, 0], motion[:, 3] = command[:, 0] * CONTROL_DT, command[:, 2] * CONTROL_DT
    for _ in range(steps):
        feet = feet - motion[:, None, :3]
        gait = tick(np, CONFIG, gait, motion, command, feet)
        plan = plan_footholds(np, CONFIG, None, gait, command[:, :2], command, feet)
        gait = aim(np, CONFIG, gait, plan, command[:, :2], command, feet)
        feet = swing_path(np, CONFIG, gait, feet)
        feet[..., 2] = np.where(swings(np, CONFIG, gait), feet[..., 2], -0.4)
    return gait, feet


@pytest.mark.parametrize(("freeze", "moves"), [(0.9, True), (0.5, False)])
def test_a_foothold_follows_the_plan_until_its_swing_is_so_far(freeze: float, moves: bool) -> None:
    command = commands((0.5, 0, 0))
    gait, feet = walk(60, command)
    late = np.full((1, 4), 0.7, np.float32) * swing_fraction(np, CONFIG, gait.period)[:, None]
    gait = gait._replace(phases=late)
    level = 0 * late
    ahead = np.stack([level + 0.05, level], -1)
    plan = Plan(ahead, level, level + CONFIG.lift, level + 1.0)
    after = aim(np, CONFIG, gait, plan, command[:, :2], command, feet, freeze)
    assert ((np.abs(after.target - gait.target) > 1e-3).any(-1) == moves).all()


def test_period_follows_the_commanded_speed() -> None:
    period = wanted_period(np, CONFIG, commands((0.6, 0, 0), (2.0, 0, 0), (0, 0, 0)))
    assert period[0] == pytest.approx(CONFIG.stride / 0.6)
    assert period[1:] == pytest.approx(list(CONFIG.period))


def test_a_robot_that_is_told_to_stand_keeps_all_feet_down() -> None:
    gait, _ = walk(200, commands((0, 0, 0), (0.5, 0, 0)))
    assert not swings(np, CONFIG, gait)[0].any()
    stopped = commands((0, 0, 0), (0, 0, 0))
    feet, still = standing(2), np.zeros((2, 4), np.float32)
    for _ in range(200):
        gait = tick(np, CONFIG, gait, still, stopped, feet)
    assert not swings(np, CONFIG, gait).any()


def test_diagonal_legs_swing_together_and_two_feet_stand() -> None:
    command = commands((0.5, 0, 0))
    gait, feet = walk(100, command)
    for _ in range(60):
        gait = tick(np, CONFIG, gait, np.zeros((1, 4), np.float32), command, feet)
        up = swings(np, CONFIG, gait)[0]
        assert up[0] == up[3] and up[1] == up[2] and not up.all() and up.sum() in (0, 2)
    assert np.abs(unison(np, gait.phases)).max() < 1e-4


def test_the_hip_passes_over_raiberts_foothold_in_the_middle_of_the_stance() -> None:
    command = commands((0.6, 0.1, 0.0))
    gait, _ = walk(100, command)
    place, _ = raibert(np, CONFIG, gait, command[:, :2], command)
    left = time_to_touch_down(np, CONFIG, gait)
    half = (1 - swing_fraction(np, CONFIG, gait.period)) * gait.period / 2
    moved = command[:, None, :2] * (left + half[:, None])[..., None]
    np.testing.assert_allclose(place - moved, stance_places(CONFIG)[None], atol=1e-5)


@given(
    st.lists(st.floats(-0.02, 0.02), min_size=3, max_size=3),
    st.floats(-0.2, 0.2),
    st.floats(-3.0, 3.0),
)
@settings(max_examples=50, deadline=None)
def test_what_is_remembered_stays_where_it_is_in_the_world(move: list[float], turned: float, yaw: float) -> None:
    before = home_qpos(1.0, 2.0, 0.4, yaw)[None]
    after = home_qpos(1.0 + move[0], 2.0 + move[1], 0.4 + move[2], yaw + turned)[None]
    feet = feet_in_heading_frame(np, before)
    gait = start_gait(np, CONFIG, feet)
    moved = tick(np, CONFIG, gait, motion_between(np, before, after), np.zeros((1, 3)), feet)

    def in_world(place: np.ndarray, qpos: np.ndarray, heading: float) -> np.ndarray:
        c, s = np.cos(heading), np.sin(heading)
        return place @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]) + qpos[0, :3]

    for old, new in ((gait.target, moved.target), (gait.lift, moved.lift)):
        np.testing.assert_allclose(in_world(new, after, yaw + turned), in_world(old, before, yaw), atol=1e-9)
    apex = moved.apex + after[:, 2:3]
    np.testing.assert_allclose(apex, gait.apex + before[:, 2:3], atol=1e-9)


def test_path_leaves_the_ground_clears_the_apex_and_comes_down_on_the_target() -> None:
    feet = standing(1)
    gait = start_gait(np, CONFIG, feet)
    fraction = float(swing_fraction(np, CONFIG, gait.period)[0])
    target = feet + np.array([0.3, 0.02, 0.03], np.float32)
    heights = []
    for s in np.linspace(0, 0.999, 101):
        now = gait._replace(phases=np.full((1, 4), s * fraction, np.float32), target=target, apex=feet[..., 2] + 0.2)
        place = swing_path(np, CONFIG, now, feet)
        heights.append(place[0, 0, 2] - feet[0, 0, 2])
        if s == 0:
            np.testing.assert_allclose(place, feet, atol=1e-3)
    np.testing.assert_allclose(place, target, atol=6e-3)
    assert max(heights) == pytest.approx(0.2, abs=2e-3)
    assert heights[10] > 0.08  # near block sides a foot has to rise early


def test_the_knee_is_a_link_away_from_foot_and_hip_and_points_back() -> None:
    ahead, hip = np.meshgrid(np.linspace(-0.25, 0.25, 11), np.linspace(0.25, 0.42, 7))
    back, up = knee_from_foot(np, ahead, hip)
    np.testing.assert_allclose(np.hypot(back, up), LINK, atol=1e-6)
    np.testing.assert_allclose(np.hypot(back + ahead, up - hip), LINK, atol=1e-6)
    assert (back < -ahead / 2 + 1e-9).all()


@pytest.mark.parametrize(("height", "clean"), [(0.05, 8), (0.10, 8), (0.15, 8)])
def test_planned_feet_and_shanks_clear_a_bar_and_are_in_reach(height: float, clean: int) -> None:
    over = glide(CONFIG, height, speed=0.5, robots=8)
    assert not over.foot.any()
    assert min((~over.shank).sum(), over.in_reach.sum()) >= clean


def test_without_a_map_feet_come_down_on_the_bar() -> None:
    over = glide(GaitConfig(map=False), 0.10, speed=0.5, robots=8)
    assert over.foot.all()


@pytest.mark.slow
def test_all_array_modules_agree() -> None:
    frame = GridFrame(-4.0, -4.0, 0.05, (161, 161))
    field, bar = flat_field(frame), Boxes(np.array([[0.5, 0.1, 0.4, 0.2, 2.0, 0.0, 0.1]]))
    raise_boxes(field, bar, BLOCK)
    ground = build_ground_map(field.heights, frame, bar)
    rng = np.random.default_rng(3)
    n = 5
    qpos = np.stack(
        [home_qpos(x, 0.1, 0.38, yaw) for x, yaw in zip(rng.uniform(-1, 0.5, n), rng.uniform(-1, 1, n), strict=True)]
    )
    qpos = qpos.astype(np.float32)
    command = np.stack([rng.uniform(0.2, 0.8, n), 0 * rng.uniform(size=n), rng.uniform(-0.6, 0.6, n)], 1)
    command, motion = command.astype(np.float32), rng.uniform(-0.01, 0.01, (n, 4)).astype(np.float32)
    feet = feet_in_heading_frame(np, qpos)
    gait = start_gait(np, CONFIG, feet)._replace(
        phases=rng.uniform(0, 1, (n, 4)).astype(np.float32), period=np.full(n, 0.9, np.float32)
    )

    def step(xp, convert, plan=None):
        state, f, c = GaitState(*map(convert, gait)), convert(feet), convert(command)
        state = tick(xp, CONFIG, state, convert(motion), c, f)
        if plan is None:
            view = FieldView(xp, type(ground)(*map(convert, ground)), frame, convert(qpos))
            plan = plan_footholds(xp, CONFIG, view, state, c[:, :2], c, f)
        state = aim(xp, CONFIG, state, Plan(*map(convert, plan)), c[:, :2], c, f)
        return plan, [np.asarray(x) for x in (*state, gait_rows(xp, CONFIG, state, f))]

    plan, expected = step(np, np.asarray)
    _, in_jax = step(jnp, jnp.asarray)
    _, in_torch = step(torch, torch.as_tensor, plan)
    assert expected[-1].shape == (n, GAIT_SIZE)
    for other in (in_jax, in_torch):
        for a, b in zip(expected, other, strict=True):
            np.testing.assert_allclose(a, b, atol=2e-5)
    assert np.abs(plan.offset).max() > 0.05  # the bar is in the way of some


def test_hips_and_offsets_are_in_the_order_of_the_legs() -> None:
    assert (np.sign(HIPS[:, :2]) == np.sign(stance_places(CONFIG))).all()
    assert OFFSETS[0] == OFFSETS[3] != OFFSETS[1] == OFFSETS[2]


@pytest.mark.parametrize(
    "setting",
    [{"period": (0.0, 1.0)}, {"stride": 0.0}, {"swing_fraction": 0.6}, {"hip_height": 0.6}, {"modulate": 1.0}],
)
def test_impossible_gaits_are_refused(setting: dict) -> None:
    with pytest.raises(InputError, match=f"gait.{next(iter(setting))}"):
        GaitConfig(**setting)


def test_what_a_slow_trunk_has_missed_is_kept_up_to_a_limit_and_forgotten_when_it_stands() -> None:
    feet, gait = standing(1), start_gait(np, CONFIG, standing(1))
    command, slow = np.array([[0.5, 0.0, 0.0]]), np.array([[0.4, 0.0]])
    missed = []
    for _ in range(100):  # 2 s at 0.1 m/s less than told
        plan = plan_footholds(np, CONFIG, None, gait, slow, command, feet)
        gait = aim(np, CONFIG, gait, plan, slow, command, feet)
        missed.append(float(gait.missed[0, 0]))
    assert missed[24] == pytest.approx(0.05)
    assert missed[-1] == pytest.approx(0.12)
    gait = aim(np, CONFIG, gait, plan, 0 * slow, 0 * command, feet)
    assert (gait.missed == 0).all()


def test_places_on_a_track_cost_the_same_one_by_one() -> None:
    frame = GridFrame(-4.0, -4.0, 0.05, (161, 161))
    field, bar = flat_field(frame), Boxes(np.array([[0.5, 0.1, 0.4, 0.2, 2.0, 0.0, 0.1]]))
    raise_boxes(field, bar, BLOCK)
    qpos = home_qpos(0.0, 0.1, 0.38, 0.4)[None]
    view = FieldView(np, build_ground_map(field.heights, frame, bar), frame, qpos)
    gait = start_gait(np, CONFIG, feet_in_heading_frame(np, qpos))._replace(period=np.full(1, 0.96))
    command = np.array([[0.5, 0.0, 0.2]])
    points = np.random.default_rng(0).uniform(-0.8, 0.8, (1, 4, 20, 2))
    heading = np.full((1, 4), 0.1)
    every = obstruction(np, CONFIG, view, gait, command, points[:, :, None], heading, LEANS[:, None])
    assert every.shape == (1, 4, len(LEANS), 20)
    for k, lean in enumerate(LEANS):
        alone = obstruction(np, CONFIG, view, gait, command, points, heading, np.full(20, lean))
        np.testing.assert_allclose(every[:, :, k], alone, atol=1e-4)
    assert (every[0, 0, 0] != every[0, 0, -1]).any() and (every == 0).any()
