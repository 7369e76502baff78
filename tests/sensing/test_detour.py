"""Detours: which way a command is bent, that its bent form leads past blocks, and that it is left alone without any."""

import math

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vinl.config.errors import InputError
from vinl.robot.aliengo import home_qpos
from vinl.sensing.detour import STANCE, DetourConfig, bend_command, keep_out, plan_detours
from vinl.world.boxes import Boxes
from vinl.world.grid import BLOCK, WALL, GridFrame, HeightField, flat_field, raise_boxes

CONFIG = DetourConfig()
FRAME = GridFrame(-4.0, -4.0, 0.05, (161, 161))
AHEAD = np.array([[0.6, 0.0, 0.0]])


def ground(*blocks: tuple[float, float], label: int = BLOCK) -> HeightField:
    """Level floor with blocks of 0.3 x 0.2 m."""
    field = flat_field(FRAME)
    rows = np.array([[x, y, 0.0, 0.2, 0.3, 0.0, 0.15] for x, y in blocks]).reshape(-1, 7)
    raise_boxes(field, Boxes(rows), label)
    return field


def plan(field: HeightField, qpos: np.ndarray, command: np.ndarray, config: DetourConfig = CONFIG) -> np.ndarray:
    return plan_detours(np, keep_out(field, config.margin).ravel(), field.frame, qpos, command, config)


def walk(field: HeightField, command: np.ndarray, config: DetourConfig | None, seconds: float = 4.0) -> float:
    """Seconds that the feet of a robot from the origin spend on blocks, if it does what it is told to the letter."""
    x, y, yaw, spent = 0.0, 0.0, 0.0, 0.0
    for _ in range(round(seconds / 0.02)):
        told = command
        if config is not None:
            closed, qpos = keep_out(field, config.margin).ravel(), home_qpos(x, y, yaw=yaw)[None]
            told = bend_command(np, closed, field.frame, qpos, command, config)
        forward, left, turn = told[0].tolist()
        x += 0.02 * (math.cos(yaw) * forward - math.sin(yaw) * left)
        y += 0.02 * (math.sin(yaw) * forward + math.cos(yaw) * left)
        yaw += 0.02 * turn
        turned = np.array([[np.cos(yaw), np.sin(yaw)], [-np.sin(yaw), np.cos(yaw)]])
        row, column = np.moveaxis(field.frame.cell(STANCE @ turned + [x, y]), -1, 0)
        spent += 0.02 * float((field.labels[row, column] == BLOCK).sum())
    return spent


@given(st.floats(-3, 3), st.floats(0.1, 1.0), st.floats(-1.0, 1.0))
def test_nothing_is_bent_on_open_ground(yaw: float, forward: float, turn: float) -> None:
    qpos, command = home_qpos(0.3, -0.2, yaw=yaw)[None], np.array([[forward, 0.0, turn]])
    assert (plan(ground(), qpos, command) == 0).all()
    assert (plan(ground((-2.0, 3.0)), home_qpos()[None], AHEAD) == 0).all()


def test_a_robot_that_stands_or_turns_on_the_spot_is_left_alone() -> None:
    field = ground((0.5, 0.16), (0.3, -0.2))
    commands = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 0.8]])
    assert (plan(field, np.stack([home_qpos()] * 2), commands) == 0).all()


def test_it_goes_to_the_other_side_of_a_block_in_the_way_of_a_foot() -> None:
    for side in (1, -1):
        sideways, turn = plan(ground((1.2, side * 0.22)), home_qpos()[None], AHEAD)[0]
        assert side * sideways <= 0 and side * turn <= 0 and abs(sideways) + abs(turn) > 0.02


@settings(max_examples=15, deadline=None)
@given(st.lists(st.tuples(st.floats(0.7, 2.2), st.floats(-0.5, 0.5)), min_size=1, max_size=3), st.floats(-0.6, 0.6))
def test_a_mirrored_ground_gives_mirrored_detours(blocks: list[tuple[float, float]], turn: float) -> None:
    command = np.array([[0.6, 0.0, turn]])
    detour = plan(ground(*blocks), home_qpos()[None], command)
    mirrored = plan(ground(*((x, -y) for x, y in blocks)), home_qpos()[None], command * [1, 1, -1])
    # of two that cost the same either may be chosen
    cost = [v[0, 0] ** 2 + CONFIG.turning * v[0, 1] ** 2 for v in (detour, mirrored)]
    assert np.allclose(mirrored, -detour) or np.isclose(*cost, atol=1e-9)


def test_the_bent_command_leads_the_feet_past_the_block() -> None:
    for block in ((1.2, 0.2), (1.6, -0.12), (1.0, 0.1)):
        field = ground(block)
        assert walk(field, AHEAD, CONFIG) < 0.3 * walk(field, AHEAD, None)  # places 9 cm apart are looked at


def test_a_block_between_the_legs_is_no_obstacle() -> None:
    narrow = flat_field(FRAME)
    raise_boxes(narrow, Boxes(np.array([[1.2, 0.0, 0.0, 0.3, 0.1, 0.0, 0.15]])), BLOCK)
    assert (plan(narrow, home_qpos()[None], AHEAD) == 0).all()


def test_what_is_too_far_is_not_seen_yet_and_walls_count() -> None:
    qpos, field = home_qpos()[None], ground((1.5, 0.2))
    assert (plan(field, qpos, AHEAD) != 0).any()
    assert (plan(field, qpos, AHEAD, DetourConfig(ahead=1.0)) == 0).all()
    assert (plan(field, qpos, AHEAD, DetourConfig(horizon=1.5)) == 0).all()
    assert (plan(ground((1.5, 0.2), label=WALL), qpos, AHEAD) != 0).any()


def test_a_higher_price_bends_more() -> None:
    field, qpos = ground((1.2, 0.18)), home_qpos()[None]
    efforts = [np.abs(plan(field, qpos, AHEAD, DetourConfig(price=price))).sum() for price in (1e-3, 0.1, 1.0)]
    assert efforts[0] == 0 and 0 < efforts[1] <= efforts[2]


@given(st.floats(0.0, 0.3))
def test_feet_keep_the_margin(margin: float) -> None:
    field = ground((0.0, 0.0))
    closed = keep_out(field, margin)
    grid = np.stack(np.meshgrid(*field.frame.centres()), -1)
    away = np.linalg.norm(np.maximum(np.abs(grid) - [0.1, 0.15], 0), axis=-1)
    r = field.frame.resolution
    assert closed[field.labels == BLOCK].all()
    assert not closed[away > margin + r].any()
    assert closed[away < margin - r].all()


def test_numpy_and_jax_plan_the_same() -> None:
    rng = np.random.default_rng(0)
    field = ground(*rng.uniform(-3, 3, (20, 2)))
    qpos = np.stack([home_qpos(*rng.uniform(-2, 2, 2), yaw=rng.uniform(-3, 3)) for _ in range(64)]).astype(np.float32)
    command = np.stack([rng.uniform(0, 1, 64), np.zeros(64), rng.uniform(-1, 1, 64)], 1).astype(np.float32)
    closed = keep_out(field, CONFIG.margin).ravel()
    here = plan_detours(np, closed, FRAME, qpos, command, CONFIG)
    there = jax.jit(lambda *args: plan_detours(jnp, args[0], FRAME, *args[1:], CONFIG))(closed, qpos, command)
    # sines are rounded differently: a foot on the border of two cells may be taken for either side
    assert np.isclose(here, np.asarray(there)).all(1).mean() > 0.9
    assert (here != 0).any(1).sum() > 20


@pytest.mark.parametrize(
    ("field", "value"),
    [("ahead", 0.2), ("horizon", 0), ("step", -1), ("step", 4), ("margin", -0.1), ("price", 0), ("turning", np.inf)],
)
def test_impossible_detours_are_refused(field: str, value: float) -> None:
    with pytest.raises(InputError, match=rf"detour\.{field}"):
        DetourConfig(**{field: value})
