"""gymnasium's own checks, pictures, episodes that end within a step."""

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from vinl.config.errors import InputError
from vinl.nav.gym import ID, NavEnv, NavVectorEnv

SMALL = ("camera.width=16", "camera.height=12", "homes.goals=4", "homes.starts=64")


def test_single_robot_passes_the_checker():
    env = gymnasium.make(ID, render_mode="rgb_array", plans=["harbour_flat"], overrides=SMALL)
    check_env(env.unwrapped)
    env.reset(seed=1)
    for _ in range(5):
        env.step(env.action_space.sample())
    picture = env.render()
    assert picture.dtype == np.uint8 and picture.shape[0] == 360 and picture.std() > 10
    env.close()
    with pytest.raises(InputError, match="rgb_array"):
        NavEnv(render_mode="human")


def test_vector_ends_and_begins_in_one_step():
    overrides = (*SMALL, "episodes.steps=4")
    envs = gymnasium.make_vec(
        ID, num_envs=6, vectorization_mode="vector_entry_point", plans=["harbour_flat"], overrides=overrides
    )
    assert isinstance(envs.unwrapped, NavVectorEnv)
    first, _ = envs.reset(seed=3)
    again, _ = envs.reset(seed=3)
    assert all((first[name] == again[name]).all() for name in first)
    assert envs.observation_space.contains(first)
    still = np.tile(np.array([-1.0, 0.6], np.float32), (6, 1))
    for _ in range(4):
        observation, reward, success, timeout, info = envs.step(still)
    assert timeout.all() and not success.any() and reward.shape == (6,)
    assert (info["final_obs"]["vector"][:, 4] > 0).all() and (observation["vector"][:, 3:] == 0).all()
    assert (info["record"]["steps"] == 4).all() and info["_record"].all()
    envs.close()
