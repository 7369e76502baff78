"""The chain as an environment: gymnasium's checks, and the same episode as ``vinl.evaluate`` runs."""

import subprocess
import sys
import warnings
from dataclasses import replace
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import vinl
import vinl.gym
from vinl.chain import controller
from vinl.chain.batching import batch_policy
from vinl.chain.config import EvaluationConfig
from vinl.chain.ground_reader import GaitReader, ScanReader, map_plan
from vinl.chain.navigators.oracle import OracleNavigator
from vinl.chain.records import plain_record
from vinl.config.errors import InputError
from vinl.config.loader import load_config
from vinl.gait.observation import insert_gait
from vinl.gym.home import JOINT_REACH, HomeEnv
from vinl.nav.config import NavConfig
from vinl.policies.card import find_gait, navigation_table
from vinl.policies.policy import LocomotionPolicy
from vinl.policies.velocity_range import VelocityRange
from vinl.robot.aliengo import ACTION_SCALE
from vinl.robot.observation import observe
from vinl.world.boxes import Blocks

pytestmark = pytest.mark.slow

ID, PLAN = "vinl/Home-v0", "harbour_flat"
NEAR = EvaluationConfig(min_distance=2.0)
RANGE = VelocityRange((-0.3, 0.8))
PLAIN = ["reward.scale=1.0", "reward.path=0.0", "reward.slack=-0.002"]
"""Of an action, as in training: configs/nav/default.yaml."""


class StepwiseOracle(OracleNavigator):
    """The oracle with the resolution of an action."""

    def act(self, observation: dict[str, Any]) -> np.ndarray:
        return RANGE.velocity(RANGE.action(super().act(observation)))


@pytest.mark.parametrize(
    "options",
    [
        {},
        {"obstacles": "none", "cameras": {"ahead": "navigation", "ground": "locomotion"}, "height_scan": True},
        {"control": "joints", "navigator": "oracle"},
        {"control": "joints", "cameras": {}},
    ],
    ids=["velocity", "two cameras", "joints", "blind joints"],
)
def test_passes_the_checker(options: dict) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        env = gymnasium.make(ID, render_mode=None if options else "rgb_array", floorplans=PLAN, **options)
        check_env(env.unwrapped, skip_render_check=bool(options))  # pictures of a moment take a second in all
        env.close()


def test_spaces_are_those_of_the_navigator_or_of_the_legs() -> None:
    env = gymnasium.make(ID, floorplans=PLAN).unwrapped
    assert isinstance(env, HomeEnv)
    nav = load_config(NavConfig, "nav/default")
    assert nav.camera is not None
    known = sum(row["size"] for row in navigation_table(nav.previous))
    sizes = {"vector": (known,), "depth": (nav.camera.height, nav.camera.width)}
    assert {name: space.shape for name, space in env.observation_space.items()} == sizes
    assert env.action_space.shape == (2,) and env.metadata["render_fps"] == 2
    legs = HomeEnv(floorplans=PLAN, control="joints")
    sizes = {"goal": (3,), "proprioception": (48,), "depth": (56, 96)}
    assert {name: space.shape for name, space in legs.observation_space.items()} == sizes
    assert legs.action_space.shape == (12,) and legs.metadata["render_fps"] == 50


def test_same_seed_same_episode() -> None:
    env = HomeEnv(floorplans=[PLAN, "old_town"], locomotor="rough")

    def walk(seed: int) -> list:
        observation, info = env.reset(seed=seed)
        rows = [observation["vector"], observation["depth"], info["plan"]]
        for action in ([1.0, 0.0], [0.2, -1.0]):
            observation, reward, *_, info = env.step(np.array(action, np.float32))
            rows += [observation["vector"], observation["depth"], reward, info]
        return rows

    first, again, other = walk(3), walk(3), walk(4)
    for a, b in zip(first, again, strict=True):
        np.testing.assert_equal(a, b)
    assert not np.array_equal(first[1], other[1])
    following = env.reset()[0]["vector"]
    assert not np.array_equal(following, env.reset()[0]["vector"])


def test_oracle_walks_the_episode_that_evaluate_walks() -> None:
    plan = vinl.load_floorplan(PLAN)
    results = vinl.evaluate([plan], "teacher", StepwiseOracle(), 1, 1, first_seed=2, obstacles="paper", config=NEAR)
    env = HomeEnv(floorplans=plan, locomotor="teacher", rules=NEAR, overrides=PLAIN)
    _, info = env.reset(seed=0, options={"episode": 0, "seed": 2})
    oracle, rewards, over, out = OracleNavigator(NEAR.oracle), [], False, False
    assert env.trip is not None and env.velocity_range == RANGE
    began, straight = info["geodesic_m"], info["straight_m"]
    oracle.reset([env.trip.task])
    while not (over or out):
        action = RANGE.action(oracle.act({"pose": env.trip.pose}))[0]
        observation, reward, over, out, info = env.step(action)
        rewards.append(reward)
        assert env.observation_space.contains(observation)
    assert info["record"] == plain_record(results.records[0])
    assert straight == pytest.approx(results.records[0].straight_m, abs=1e-3) and info["straight_m"] < 0.4
    assert over and info["success"] and info["spl"] > 0.8
    n = len(rewards)
    assert n == np.ceil(info["time_s"] / 0.5)
    least, most = 10 + began - info["geodesic_m"] - 0.005 * n, 10 + began - info["geodesic_m"] - 0.002 * n
    assert least - 1e-9 <= sum(rewards) <= most + 1e-9
    with pytest.raises(InputError, match="call reset first"):
        env.step(action)


def test_joints_walk_the_episode_that_evaluate_walks(monkeypatch: pytest.MonkeyPatch) -> None:
    """A locomotor driven from outside, by actions that lose nothing: the reach is a power of two of its scale."""
    rules = replace(NEAR, time_limit=2.0)
    policy = vinl.load_policy("no_pretraining")
    gait = find_gait(policy.card)
    assert gait is not None and isinstance(policy, LocomotionPolicy) and JOINT_REACH / ACTION_SCALE == 16
    legs = batch_policy(policy)
    legs.reset(1)
    asked = []
    plain = controller.check_actions
    monkeypatch.setattr(controller, "check_actions", lambda *args: asked.append(plain(*args)) or asked[-1])
    plan = vinl.load_floorplan(PLAN)
    record = vinl.evaluate([plan], policy, "oracle", 1, 1, obstacles="none", config=rules).records[0]
    env = HomeEnv(
        floorplans=plan,
        control="joints",
        navigator="oracle",
        rules=rules,
        obstacles="none",
        height_scan=True,
        cameras={},
    )
    observation, _ = env.reset(options={"plan": PLAN})
    trip, blocks = env.trip, [Blocks.empty()]
    assert trip is not None
    ground, reader = ScanReader(plan, blocks).read(trip.qpos), GaitReader(gait, map_plan(plan, blocks))
    wanted = observe(np, trip.qpos, trip.qvel, env._command, np.zeros((1, 12)), ground)[0, 48:]
    np.testing.assert_array_equal(observation["height_scan"], wanted.astype(np.float32))
    out, k = False, 0
    while not out:
        _, rows = reader.read(trip.qpos, trip.qvel, env._command)
        action = legs.act(insert_gait(np, observation["proprioception"][None], rows))[0]
        np.testing.assert_array_equal(action, asked[k][0])
        observation, _, over, out, info = env.step(action / np.float32(16))
        k += 1
        assert not over
    assert info["record"] == plain_record(record) and info["end_reason"] == "timeout" and k == 100


def test_what_an_agent_observes_is_what_the_table_says() -> None:
    env = HomeEnv(floorplans=PLAN, control="joints", navigator="oracle", obstacles="none")
    env.reset(seed=1)
    action = np.linspace(-0.05, 0.05, 12).astype(np.float32)
    observation, *_ = env.step(action)
    assert env.trip is not None
    trip = env.trip
    command = env._command
    assert command[0, 0] > 0 or command[0, 2] != 0
    wanted = observe(np, trip.qpos, trip.qvel, command, 16 * action[None], np.zeros((1, 187)))[0, :48]
    np.testing.assert_allclose(observation["proprioception"], wanted, rtol=1e-6)
    np.testing.assert_allclose(observation["goal"] * [5, 1, 1], trip.goal[0], rtol=1e-6)
    assert 0 < observation["depth"].min() < observation["depth"].max() <= 1


def test_navigator_reads_how_the_robot_moved_or_what_it_asked_for() -> None:
    action = np.array([0.5, 0.8], np.float32)
    seen = {}
    for previous in ("action", "motion", "both", "step"):
        env = HomeEnv(
            floorplans=PLAN, obstacles="none", cameras={}, overrides=[f"previous={previous}", "network.grid=false"]
        )
        assert not env.reset(seed=0)[0]["vector"][3:].any()
        env.step(action)
        seen[previous] = env.step(action)[0]["vector"][3:]
    np.testing.assert_array_equal(seen["action"], action)
    np.testing.assert_allclose(seen["motion"], action, atol=0.25)
    np.testing.assert_array_equal(seen["both"], [*seen["action"], *seen["motion"]])
    assert (seen["motion"] != action).all()
    np.testing.assert_array_equal(seen["step"][:2], action)
    np.testing.assert_allclose(seen["step"][4] / (0.5 * np.pi / 3), seen["motion"][1], atol=1e-6)


def test_fall_and_time_limit() -> None:
    env = HomeEnv(floorplans=PLAN, control="joints", cameras={}, obstacles="none")
    env.reset(seed=0)
    for _ in range(200):
        _, reward, over, out, info = env.step(np.tile([1.0, -1.0, 0.5], 4).astype(np.float32))
        if over:
            break
    assert over and not out and info["end_reason"] == "fall" and not info["success"] and info["spl"] == 0 and reward < 1
    env = HomeEnv(floorplans=PLAN, rules=replace(NEAR, time_limit=0.7), obstacles="none", cameras={})
    env.reset(seed=0)
    env.step(np.zeros(2, np.float32))
    _, _, over, out, info = env.step(np.zeros(2, np.float32))
    assert out and not over and info["time_s"] == pytest.approx(0.7)


def test_several_at_once() -> None:
    envs = gymnasium.make_vec(ID, 2, "sync", floorplans=PLAN, cameras={})
    observation, _ = envs.reset(seed=5)
    assert observation["vector"].shape[0] == 2 and not np.array_equal(*observation["vector"])
    _, reward, *_ = envs.step(np.zeros((2, 2), np.float32))
    assert reward.shape == (2,)
    envs.close()


def test_picture_shows_the_robot() -> None:
    env = HomeEnv("rgb_array", PLAN)
    env.reset(seed=0)
    first = env.render()
    env.step(np.array([1.0, 0.0], np.float32))
    second = env.render()
    assert first is not None and first.shape == (480, 640, 3) and first.dtype == np.uint8 and first.std() > 10
    assert not np.array_equal(first, second)
    assert HomeEnv(floorplans=PLAN).render() is None


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"render_mode": "human"}, "rgb_array"),
        ({"control": "torque"}, "velocity or joints"),
        ({"obstacles": "papr"}, "did you mean 'paper'"),
        ({"cameras": {"depth": "navigatoin"}}, "did you mean 'navigation'"),
        ({"cameras": {"vector": "navigation"}}, "another observation"),
        ({"joint_reach": 0.0}, "joint_reach"),
        ({"control": "joints", "locomotor": "rough"}, "the agent is the locomotor"),
        ({"navigator": "oracle"}, "the agent is the navigator"),
        ({"floorplans": [PLAN, vinl.load_floorplan(PLAN)]}, "two floor plans"),
    ],
)
def test_options_that_make_no_sense(options: dict, words: str) -> None:
    with pytest.raises(InputError, match=words):
        HomeEnv(**{"floorplans": PLAN, **options})


def test_resets_and_actions_that_make_no_sense() -> None:
    env = HomeEnv(floorplans=PLAN, cameras={})
    for options, words in (
        ({"plan": "harbor_flat"}, "did you mean 'harbour_flat'"),
        ({"room": 1}, "no option 'room'"),
        ({"seed": -1}, "negative"),
    ):
        with pytest.raises(InputError, match=words):
            env.reset(options=options)
    env.reset(seed=0)
    for action, words in ((np.zeros(3), r"shape \(2,\), got \(3,\)"), (np.full(2, np.nan), "finite")):
        with pytest.raises(InputError, match=words):
            env.step(action)


@pytest.mark.parametrize(
    "code",
    [
        "import gymnasium, vinl; gymnasium.spec('vinl/Home-v0'); gymnasium.spec('vinl/Nav-v0')",
        "import vinl, gymnasium; gymnasium.make('vinl.gym:vinl/Home-v0', floorplans='old_town')",
    ],
)
def test_names_are_known_after_import(code: str) -> None:
    subprocess.run([sys.executable, "-c", code], check=True)
