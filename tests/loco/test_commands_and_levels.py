"""Commands within their ranges, levels that follow what a robot achieved."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vinl.config.errors import InputError
from vinl.loco.config import AnnealConfig, CurriculumConfig, RandomisationConfig, RewardConfig
from vinl.loco.curriculum import next_levels
from vinl.loco.randomisation import draw_commands
from vinl.robot.commands import CommandConfig


def test_commands_keep_to_their_ranges_and_shares():
    config = CommandConfig(forward=(-0.5, 1.0), left=(-0.3, 0.3), yaw_rate=(-1.0, 0.5), hold=(1.0, 3.0))
    command, left = (np.asarray(x) for x in draw_commands(config, jax.random.PRNGKey(0), 4000))
    assert (command.min(0) >= np.array([-0.5, -0.3, -1.0]) - 1e-6).all()
    assert (command.max(0) <= np.array([1.0, 0.3, 0.5]) + 1e-6).all()
    assert left.min() >= 50 and left.max() <= 150
    speed = np.hypot(command[:, 0], command[:, 1])
    assert ((speed == 0) | (speed > config.min_speed - 1e-6)).all()
    still = (command == 0).all(1).mean()
    spinning = ((speed == 0) & (command[:, 2] != 0)).mean()
    assert still == pytest.approx(config.stand_share, abs=0.02)
    assert spinning >= config.turn_share - 0.02


def level_after(way, commanded, *, fallen=False, life=1.0, level=4, u=0.5):
    one = [jnp.array([x]) for x in (level, not fallen, fallen, float(way), float(commanded), float(life), float(u))]
    return int(next_levels(CurriculumConfig(promote=0.75, demote=0.5), 10, *one)[0])


def test_levels_follow_the_way_made():
    assert level_after(8, 10) == 5
    assert level_after(6, 10) == 4
    assert level_after(4, 10) == 3
    assert level_after(0, 1) == 4  # hardly anything was asked for
    assert level_after(0, 10, level=0) == 0


def test_a_fall_is_held_to_the_whole_episode():
    assert level_after(4, 4, fallen=True, life=0.3) == 3
    assert level_after(8, 9, fallen=True, life=0.9) == 4  # falls never promote


@given(st.floats(0, 0.999))
def test_robots_beyond_the_last_level_go_to_any(u):
    assert 0 <= level_after(9, 10, level=9, u=u) <= 9


def test_noise_comes_late():
    config = RandomisationConfig(noise_from=(0.4, 0.8))
    assert [config.noise_at(f) for f in (0.0, 0.4, 0.6, 0.8, 1.0)] == pytest.approx([0, 0, 0.5, 1, 1])
    assert RandomisationConfig().noise_at(0.0) == 1.0


def test_settings_move_between_their_bounds():
    anneal = AnnealConfig(begin=0.5, end=0.9, rewards={"sigma": 0.1, "fall": -2.0}, entropy=0.0)
    first = RewardConfig(collision=-3.0)
    assert anneal.rewards_at(0.3, first) == first
    half = anneal.rewards_at(0.7, first)
    assert (half.sigma, half.fall) == pytest.approx((0.175, -1.0))
    assert anneal.rewards_at(1.0, first) == RewardConfig(collision=-3.0, sigma=0.1, fall=-2.0)


@pytest.mark.parametrize(
    ("kind", "wrong"),
    [
        (CommandConfig, {"forward": (1.0, -1.0)}),
        (CommandConfig, {"hold": (0.0, 1.0)}),
        (CommandConfig, {"stand_share": 0.9, "turn_share": 0.9}),
        (AnnealConfig, {"begin": 0.9, "end": 0.5}),
        (AnnealConfig, {"rewards": {"collisions": -1.0}}),
        (AnnealConfig, {"rewards": {"sigma": 0.0}}),
        (RewardConfig, {"floor": 1.0}),
        (RandomisationConfig, {"latency": (0.0, 0.1)}),
        (RandomisationConfig, {"kp_scale": (0.0, 1.0)}),
        (RandomisationConfig, {"noise_from": (0.8, 0.4)}),
        (RandomisationConfig, {"velocity_bias": -0.1}),
        (CurriculumConfig, {"promote": 0.2}),
    ],
)
def test_impossible_settings_are_refused(kind, wrong):
    with pytest.raises(InputError):
        kind(**wrong)
