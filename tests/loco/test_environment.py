"""The locomotion environment: observations, rewards, contacts and ends of episodes as a learner meets them."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from vinl.loco.environment import LocoEnvironment
from vinl.loco.simulation import Body, Simulation
from vinl.robot.aliengo import DEFAULT_POSE, home_qpos
from vinl.robot.observation import NOISE, SCAN_POINTS, observe
from vinl.sensing.height_scan import scan_ground
from vinl.world.boxes import Boxes
from vinl.world.grid import GridFrame
from vinl.world.heightfield import BLOCK, WALL, flat_field, raise_boxes


@pytest.fixture(scope="module")
def env(small_config):
    return LocoEnvironment(small_config)


@pytest.fixture
def fresh(env, small_config):
    """The environment in its first state."""
    env.state = jax.device_put(jax.jit(env._first_state)(jax.random.PRNGKey(0)), jax.devices()[0])
    return env


def test_observation_is_that_of_the_evaluation(fresh):
    fresh.step(jnp.zeros((8, 12)))
    state, field = fresh.state, fresh.terrain.ground
    qpos, qvel = np.asarray(state.body.qpos), np.asarray(state.body.qvel)
    ground = scan_ground(np, field.heights.reshape(-1), field.frame, qpos)
    expected = observe(np, qpos, qvel, np.asarray(state.command), np.asarray(state.action), ground)
    noisy, exact = fresh.observe()
    assert np.allclose(exact, expected, atol=1e-4)
    assert (np.abs(np.asarray(noisy) - expected) <= NOISE + 1e-4).all()
    assert np.abs(np.asarray(noisy) - expected)[:, -len(SCAN_POINTS) :].max() > 0.1


def test_robots_that_hold_the_default_pose_stand_for_a_second(fresh):
    for _ in range(50):
        result = fresh.step(jnp.zeros((8, 12)))
        assert not np.asarray(result.done & ~result.timeout).any()
    measures = fresh.read_measures()
    assert measures["falls_per_minute"] == 0
    assert measures["not_finite"] == 0
    assert fresh.read_measures()["reward"] == 0  # reading set the sums to zero


def test_reward_is_the_sum_of_its_terms_and_never_negative(fresh):
    rng = np.random.default_rng(0)
    rewards = [fresh.step(jnp.asarray(rng.normal(size=(8, 12)), jnp.float32)).reward for _ in range(5)]
    assert min(float(r.min()) for r in rewards) >= 0
    measures = fresh.read_measures()
    terms = [value for name, value in measures.items() if name.startswith("reward/")]
    assert measures["reward"] >= sum(terms) - 1e-5  # clipped at zero from below
    assert measures["reward/action_rate"] < 0 < measures["reward/linear_velocity"]


def test_a_robot_on_its_back_has_fallen_and_starts_anew(fresh):
    body = fresh.state.body
    upside = body.qpos.at[0, 3:7].set(jnp.array([0.0, 1.0, 0.0, 0.0])).at[0, 2].set(5.0)
    fresh.state = fresh.state._replace(body=body._replace(qpos=upside), life=fresh.state.life + 100)
    result = fresh.step(jnp.zeros((8, 12)))
    assert np.asarray(result.done).tolist() == [1] + [0] * 7
    assert not np.asarray(result.timeout).any()
    state = fresh.state
    assert int(state.life[0]) == 0 and int(state.life[1]) == 101
    start = fresh.terrain.starts[int(state.level[0]), int(state.column[0])]
    assert np.abs(np.asarray(state.body.qpos[0, :2]) - start[:2]).max() <= fresh.config.randomisation.start_xy + 0.1
    assert not np.asarray(state.action[0]).any()


def test_episodes_end_by_time_and_are_bootstrapped(fresh):
    fresh.state = fresh.state._replace(step=fresh.state.step.at[:].set(0).at[3].set(fresh.episode_steps - 1))
    result = fresh.step(jnp.zeros((8, 12)))
    assert np.asarray(result.timeout).tolist() == [0, 0, 0, 1, 0, 0, 0, 0] == np.asarray(result.done).tolist()


def test_physics_that_blew_up_never_reaches_the_learner(fresh):
    body = fresh.state.body
    fresh.state = fresh.state._replace(body=body._replace(qvel=body.qvel.at[2, 8].set(jnp.nan)))
    result = fresh.step(jnp.zeros((8, 12)).at[1].set(jnp.nan))
    assert all(np.isfinite(np.asarray(x)).all() for x in result)
    assert fresh.read_measures()["not_finite"] >= 1
    again = fresh.step(jnp.zeros((8, 12)))
    assert np.isfinite(np.asarray(again.observation)).all()


def test_same_seed_same_robots(small_config, env):
    one = jax.jit(env._first_state)(jax.random.PRNGKey(5))
    two = jax.jit(env._first_state)(jax.random.PRNGKey(5))
    assert all(bool((a == b).all()) for a, b in zip(jax.tree.leaves(one), jax.tree.leaves(two), strict=True))


def test_contacts_tell_blocks_from_walls_from_ground(small_config):
    """Four robots: on the floor, feet on a block, a front foot against a wall, in the air."""
    field = flat_field(GridFrame(-6.0, -6.0, 0.05, (241, 241)))
    raise_boxes(field, Boxes(np.array([[0.0, 3.0, 0, 1.2, 1.2, 0, 0.15]])), BLOCK)
    raise_boxes(field, Boxes(np.array([[0.29, -3.0, 0, 0.1, 2.0, 0, 1.0]])), WALL)
    sim = Simulation(field, 40.0, 2.0)
    poses = [home_qpos(0, 0, 0.37), home_qpos(0, 3, 0.52), home_qpos(0, -3, 0.37), home_qpos(3, 0, 2.0)]
    body = Body(jnp.asarray(np.stack(poses), jnp.float32), jnp.zeros((4, 18)), jnp.zeros((4, 18)))
    step = jax.jit(sim.step)
    seen = []
    for _ in range(10):
        body, contacts, _ = step(
            sim.ground,
            body,
            jnp.broadcast_to(jnp.asarray(DEFAULT_POSE, jnp.float32), (4, 12)),
            jnp.ones(4),
            jnp.zeros(4),
        )
        seen.append([np.asarray(x) for x in contacts])
    foot, shank, trunk, down, foot_block, shank_block, foot_wall, shank_wall = (
        np.any([s[k] for s in seen], 0) for k in range(8)
    )
    assert foot[0].all() and not foot_block[0].any() and not foot_wall[0].any()
    assert foot_block[1].all() and not foot_wall[1].any()
    assert (foot_wall[2] | shank_wall[2])[:2].any() and not foot_block[2].any() and not foot_wall[2][2:].any()
    assert not foot[3].any() and not shank_block.any()
    others = [0, 1, 3]  # the third robot's trunk stands in the wall too
    assert not shank[others].any() and not trunk[others].any() and not down[others].any()


def test_pushes_set_the_velocity(small_config, env):
    state = jax.jit(env._first_state)(jax.random.PRNGKey(1))
    env.state = jax.device_put(state._replace(push_left=state.push_left.at[:].set(5).at[0].set(0)), jax.devices()[0])
    before = np.asarray(env.state.body.qvel)
    env.step(jnp.zeros((8, 12)))
    after = np.asarray(env.state.body.qvel)
    assert int(env.state.push_left[0]) == round(small_config.randomisation.push_interval / 0.02)
    assert np.abs(after[0, :2]).max() <= small_config.randomisation.push_speed
    assert np.abs(after[0, :2] - before[0, :2]).max() > 0.01


def test_stage_that_does_not_exist_is_refused(small_config):
    from vinl.config.errors import InputError

    with pytest.raises(InputError, match="stage 7"):
        dataclasses.replace(small_config, stage=7)
