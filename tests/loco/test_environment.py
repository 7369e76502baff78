"""The locomotion environment: observations, rewards, contacts and ends of episodes as a learner meets them."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import torch
from first_state import first_state
from mujoco import mjx

from vinl.gait.observation import STEPPING_MAP_TABLE, insert_gait, observe_gait
from vinl.gait.state import GaitState, feet_in_heading_frame, swings
from vinl.loco.environment import LocoEnvironment
from vinl.loco.randomisation import plain_traits
from vinl.loco.simulation import PAST, Body, Simulation
from vinl.loco.vec_env import LocoVecEnv
from vinl.robot.aliengo import DEFAULT_POSE, home_qpos
from vinl.robot.observation import observe
from vinl.sensing.height_scan import scan_ground
from vinl.world.boxes import Boxes
from vinl.world.grid import BLOCK, WALL, GridFrame, flat_field, raise_boxes

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def env(small_config):
    return LocoEnvironment(small_config)


@pytest.fixture
def fresh(env, small_config):
    """The environment in its first state."""
    env.state = jax.device_put(first_state(env)(jax.random.PRNGKey(0)), jax.devices()[0])
    return env


def test_a_run_goes_on_from_what_was_seen_though_saved_again_before_a_step(fresh):
    first, second, third = (LocoVecEnv(fresh, "cpu") for _ in range(3))
    seen = first.step(torch.zeros(8, 12))[0]["policy"].clone()
    saved = first.save_state()
    saved["seen"]["noisy"] += 1.0  # told apart from what is looked at anew
    second.load_state(saved)
    third.load_state(second.save_state())
    torch.testing.assert_close(third.get_observations()["policy"], seen + 1.0, rtol=0, atol=0)
    torch.testing.assert_close(third.get_observations()["policy"], seen)


def test_contact_rows_are_those_of_mjx(env):
    """They are read off its tables, not off a collision."""
    simulation = env.simulation

    def collide(normalised):
        data = mjx.collision(simulation._mx.replace(hfield_data=normalised), simulation._start)
        return data._impl.contact.geom

    geom = np.asarray(jax.jit(collide)(simulation.ground.normalised))
    ground = simulation.model.geom("ground").id
    for sphere, rows in zip(simulation._spheres, simulation._ground_rows, strict=True):
        assert len(rows) == 4 and (np.sort(geom[rows]) == np.sort([sphere, ground])).all()
    assert (geom[simulation._leg_rows] != ground).all()
    every = np.concatenate([simulation._ground_rows.ravel(), simulation._leg_rows])
    assert np.array_equal(np.sort(every), np.arange(len(geom)))


def test_observation_is_that_of_the_evaluation(fresh):
    fresh.step(jnp.zeros((8, 12)))
    state, field = fresh.state, fresh.terrain.ground
    qpos, qvel = np.asarray(state.body.qpos), np.asarray(state.body.qvel)
    ground = scan_ground(np, field.heights.reshape(-1), field.frame, qpos)
    expected = observe(np, qpos, qvel, np.asarray(state.command), np.asarray(state.action), ground)
    gait = GaitState(*(np.asarray(x) for x in state.gait))
    rows = observe_gait(np, fresh.config.gait, gait, feet_in_heading_frame(np, qpos))
    expected = insert_gait(np, expected, rows)
    seen = fresh.observe()
    assert seen.exact.shape == (8, STEPPING_MAP_TABLE.size) and seen.privileged.shape == (8, 16 + 3 + 8)
    assert np.allclose(seen.exact, expected, atol=1e-4)
    np.testing.assert_allclose(seen.velocity, expected[:, :3] / 2.0, atol=1e-4)
    noise = np.abs(np.asarray(seen.noisy) - expected)
    c, measured = fresh.config.randomisation, slice(24, 36)  # joint speeds: noise and no bias
    assert (noise[:, measured] <= c.observation_noise * STEPPING_MAP_TABLE.noise[measured] + 1e-4).all()
    assert noise[:, measured].max() > 0.5 * c.observation_noise * STEPPING_MAP_TABLE.noise[measured].max()
    scan = STEPPING_MAP_TABLE.place("height_scan")
    assert 0.5 < noise[:, scan].max() / (c.map_noise * STEPPING_MAP_TABLE.noise[scan].max()) <= 1.001
    turn = STEPPING_MAP_TABLE.place("base_angular_velocity")
    bias = np.asarray(state.traits.angular_velocity_bias) * STEPPING_MAP_TABLE.scale[turn]
    off = np.abs(np.asarray(seen.noisy)[:, turn] - expected[:, turn] - bias)
    assert (off <= c.observation_noise * STEPPING_MAP_TABLE.noise[turn] + 1e-4).all()


def test_without_noise_all_that_is_measured_is_exact(fresh):
    fresh.set_noise(0.0)
    try:
        result = fresh.step(jnp.zeros((8, 12)))
    finally:
        fresh.set_noise(1.0)
    assert np.array_equal(result.observations.noisy, result.observations.exact)
    assert not np.array_equal(fresh.observe().noisy, fresh.observe().exact)


def test_an_action_takes_effect_after_the_robots_latency(fresh):
    """In air, a calf that is told to bend does so 0, 10 and 30 ms later."""
    late = np.array([0.0, 0.01, 0.03, 0.0, 0.0, 0.0, 0.0, 0.0], np.float32)
    state = fresh.state
    traits = plain_traits(8)._replace(latency=jnp.asarray(late))
    qpos = state.body.qpos.at[:, 2].add(3.0).at[:, 7:].set(jnp.asarray(DEFAULT_POSE, jnp.float32))
    body = state.body._replace(qpos=qpos, qvel=jnp.zeros((8, 18)))
    quiet = {"step": jnp.zeros(8, jnp.int32), "push_left": jnp.full(8, 99, jnp.int32)}
    fresh.state = jax.device_put(state._replace(body=body, traits=traits, **quiet), jax.devices()[0])
    bend = jnp.zeros((8, 12)).at[:, 2].set(-4.0)
    moved = []
    for _ in range(2):
        start = np.asarray(fresh.state.body.qpos[:, 9])
        fresh.step(bend)
        moved.append(np.asarray(fresh.state.body.qpos[:, 9]) - start)
    assert moved[0][0] < 1.5 * moved[0][1] < -0.01 and abs(moved[0][2]) < 0.2 * abs(moved[0][1])
    assert moved[1][2] < -0.01  # 10 ms of the second control step were its own


def test_the_gait_walks_on_its_own_clock_and_can_be_given(fresh):
    told = {"command": jnp.tile(jnp.array([0.5, 0.0, 0.0]), (8, 1)), "command_left": jnp.full(8, 1000, jnp.int32)}
    # placed like the rest of the state: else the step is compiled anew
    fresh.state = fresh.state._replace(**jax.device_put(told, jax.devices()[0]))
    swung = []
    for _ in range(60):
        fresh.step(jnp.zeros((8, 12)))
        swung.append(np.asarray(swings(jnp, fresh.config.gait, fresh.state.gait)))
    swung = np.array(swung)
    assert (swung[:, :, 0] == swung[:, :, 3]).mean() > 0.9  # diagonal legs together
    assert 0.25 < swung.mean() < 0.5
    measures = fresh.read_measures()
    assert measures["foot_rmse"] > 0.03 and measures["swing_hits"] > 0.3  # they stand
    given = fresh.state.gait._replace(phases=jnp.full((8, 4), 0.9))
    fresh.step(jnp.zeros((8, 12)), given)
    period = np.asarray(fresh.state.gait.period)[:, None]
    going = np.asarray(fresh.state.life) > 0
    ran = np.asarray(fresh.state.gait.phases)
    np.testing.assert_allclose(ran[going], (0.9 + 0.02 * np.asarray(given.rate) / period)[going], atol=2e-3)


def test_robots_that_hold_the_default_pose_stand_for_a_second(fresh):
    for _ in range(50):
        result = fresh.step(jnp.zeros((8, 12)))
        assert not np.asarray(result.done & ~result.timeout).any()
    measures = fresh.read_measures()
    assert measures["falls_per_minute"] == 0
    assert measures["not_finite"] == 0
    assert fresh.read_measures()["reward"] == 0  # reading set the sums to zero


def test_reward_is_the_sum_of_its_terms_and_never_negative_but_for_a_fall(fresh):
    rng = np.random.default_rng(0)
    rewards = [fresh.step(jnp.asarray(0.1 * rng.normal(size=(8, 12)), jnp.float32)).reward for _ in range(5)]
    fall = fresh.config.rewards.fall
    assert min(float(r.min()) for r in rewards) >= fall
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
    assert all(np.isfinite(np.asarray(x)).all() for x in jax.tree.leaves(result))
    assert fresh.read_measures()["not_finite"] >= 1
    again = fresh.step(jnp.zeros((8, 12)))
    assert np.isfinite(np.asarray(again.observations.noisy)).all()


def test_same_seed_same_robots(small_config, env):
    one = first_state(env)(jax.random.PRNGKey(5))
    two = first_state(env)(jax.random.PRNGKey(5))
    assert all(bool((a == b).all()) for a, b in zip(jax.tree.leaves(one), jax.tree.leaves(two), strict=True))


def test_contacts_tell_blocks_from_walls_from_ground(small_config):
    """Four robots: on the floor, feet on a block, a front foot against a wall, in the air."""
    field = flat_field(GridFrame(-6.0, -6.0, 0.05, (241, 241)))
    raise_boxes(field, Boxes(np.array([[0.0, 3.0, 0, 1.2, 1.2, 0, 0.15]])), BLOCK)
    raise_boxes(field, Boxes(np.array([[0.29, -3.0, 0, 0.1, 2.0, 0, 1.0]])), WALL)
    sim = Simulation(field, 40.0, 2.0)
    poses = [home_qpos(0, 0, 0.37), home_qpos(0, 3, 0.52), home_qpos(0, -3, 0.37), home_qpos(3, 0, 2.0)]
    body = Body(jnp.asarray(np.stack(poses), jnp.float32), jnp.zeros((4, 18)), jnp.zeros((4, 18)))
    body = jax.device_put(body, jax.devices()[0])  # placed like what a step returns: else it is compiled twice
    step, still = jax.jit(sim.step), jnp.broadcast_to(jnp.asarray(DEFAULT_POSE, jnp.float32), (4, PAST, 12))
    seen = []
    for _ in range(10):
        body, contacts, _ = step(sim.ground, body, still, jnp.zeros(4, jnp.int32), plain_traits(4))
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
    state = first_state(env)(jax.random.PRNGKey(1))
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
