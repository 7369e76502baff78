"""Stage 2: it starts from trained networks, goes on after a stop, and counts what touches a block."""

import json
import shutil
from dataclasses import asdict, replace

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
import pytest
import torch
from first_state import first_state
from small_tiles import BLOCK_TILES
from tensordict import TensorDict

from vinl.cli.app import main
from vinl.config.errors import InputError
from vinl.config.loader import dump_config, load_config
from vinl.gait.config import GaitConfig
from vinl.gait.observation import STEPPING_MAP_TABLE, STEPPING_TABLE
from vinl.loco import training
from vinl.loco.config import CurriculumConfig, LocoConfig
from vinl.loco.curriculum import next_levels
from vinl.loco.environment import LocoEnvironment
from vinl.loco.measures import tile_cover
from vinl.loco.models import StepModel
from vinl.loco.randomisation import plain_traits
from vinl.loco.simulation import PAST, Body
from vinl.loco.warm_start import load_warm_start
from vinl.policies.card import find_gait, locomotion_card
from vinl.policies.io import find_policy, load_policy, save_policy
from vinl.policies.networks import StepActor, build_network
from vinl.robot.aliengo import DEFAULT_POSE, FOOT_GEOMS, foot_positions, home_qpos
from vinl.robot.model import robot_spec
from vinl.world.terrain import TILE, build_terrain

pytestmark = pytest.mark.slow

SMALL = [
    "num_envs=16",
    *BLOCK_TILES,
    "ppo.steps=4",
    "ppo.critic_warmup=1",
    "terrain.tall_density=0",
    "terrain.block_density=0.1",
]
FOOT = 0.0265


@pytest.fixture(scope="module")
def config() -> LocoConfig:
    return load_config(LocoConfig, "loco/teacher", SMALL)


@pytest.fixture(scope="module")
def env(config) -> LocoEnvironment:
    return LocoEnvironment(config)


@pytest.fixture
def compiled_once(env, share_environment) -> None:
    share_environment(training, env)


def read_rows(folder):
    return [json.loads(line) for line in (folder / "metrics.jsonl").read_text().splitlines()]


def first_layer(folder):
    return load_policy(folder).network.state_dict()["actor.0.weight"]


def test_it_starts_from_a_policy_and_from_a_run_and_resumes(tmp_path, compiled_once, walker):
    one, two = tmp_path / "one", tmp_path / "two"
    command = ["train-loco", "--stage", "2", "--device", "cpu", *SMALL]
    assert main([*command, "--from", str(walker), "--out", str(one)]) == 0
    rows = read_rows(one)
    assert [row["iteration"] for row in rows] == [1, 2, 3]
    assert all(np.isfinite(list(row.values())).all() for row in rows)
    assert rows[0]["action_std"] == pytest.approx(0.5) != rows[2]["action_std"]
    assert rows[0]["learning_rate"] == training.WARMUP_RATE > rows[1]["learning_rate"]
    card = load_policy(one).card
    assert card.training["from_policy"] == str(walker) and card.training["stage"] == 2
    assert card.training["origin"]["policy"] == "walker" and not card.training["origin"]["critic"]
    assert find_gait(card) == GaitConfig() and card.observation_size == STEPPING_TABLE.size
    moved = (first_layer(one) - first_layer(walker)).abs().max()
    assert 0 < moved < 0.02

    assert main([*command, "--from", str(one), "--out", str(two), "--iterations", "1"]) == 0
    old, new = (torch.load(f / "checkpoint.pt", weights_only=True)["algorithm"] for f in (one, two))
    assert torch.equal(old["actor_state_dict"]["mlp.0.weight"], new["actor_state_dict"]["mlp.0.weight"])  # warming up
    change = old["critic_state_dict"]["mlp.0.weight"] - new["critic_state_dict"]["mlp.0.weight"]
    assert 0 < change.abs().max() < 0.05
    assert new["actor_state_dict"]["distribution.std_param"].eq(0.5).all()
    assert load_policy(two).card.training["origin"]["critic"]
    shutil.rmtree(one)  # to resume needs nothing of the run that it started from
    assert main(["train-loco", "--device", "cpu", "--resume", str(two), "--iterations", "3"]) == 0
    assert [row["iteration"] for row in read_rows(two)] == [1, 2, 3]
    assert load_policy(two).card.training["origin"]["policy"] == "one"


def test_policies_that_do_not_fit_are_refused(tmp_path, config, walker, capsys):
    folders = {name: tmp_path / name for name in ("small", "soft", "other", "eyes")}
    gait = asdict(GaitConfig())
    network = StepActor(actor=(8,))
    save_policy(folders["small"], network, locomotion_card("small", network.describe(), gait=gait))
    network = StepActor()
    card = locomotion_card("soft", network.describe(), gait=gait)
    save_policy(folders["soft"], network, replace(card, action={**card.action, "kp": 20.0}))
    save_policy(folders["other"], network, replace(card, gait=gait | {"stride": 0.6}))
    shutil.copytree(find_policy("rough"), folders["eyes"])
    data = json.loads((folders["eyes"] / "card.json").read_text())
    (folders["eyes"] / "card.json").write_text(json.dumps({**data, "kind": "navigation"}))
    words = {"small": "actor [8]", "soft": "kp 20", "other": "gait.stride=0.6", "eyes": "navigation"}
    cases = [(str(folders[name]), text) for name, text in words.items()]
    cases += [("none", "unknown"), ("loco", "SteppingActor"), ("nav", "navigation policy")]
    for policy, text in cases:
        for stage in ("2", "3"):
            if stage == "3" and policy == str(folders["small"]):
                continue  # a student stands behind an actor of any size
            assert main(["train-loco", "--stage", stage, "--device", "cpu", "--from", policy, "--out", "out"]) == 2
            error = capsys.readouterr().err
            assert text in error and len(error.strip().splitlines()) == 1
    assert main(["train-loco", "--resume", "x", "--from", "rough", "--device", "cpu"]) == 2
    assert "--resume" in capsys.readouterr().err
    assert main(["train-loco", "--stage", "2", "--config", "loco/rough", "--device", "cpu"]) == 2
    assert "stage 1" in capsys.readouterr().err
    with pytest.raises(InputError, match="max_contacts"):
        CurriculumConfig(max_contacts=-1.0)
    assert load_warm_start(str(walker), config).critic is None
    assert dump_config(config)["from_policy"] == "rough"


def test_promotion_can_be_bound_to_contacts():
    for limit, contacts, level in ((1.0, 9.0, 5), (1.0, 30.0, 4), (None, 30.0, 5)):
        new = next_levels(
            CurriculumConfig(promote=0.7, max_contacts=limit),
            10,
            level=jnp.array([4]),
            timeout=jnp.array([True]),
            fallen=jnp.array([False]),
            way=jnp.array([10.0]),
            commanded=jnp.array([12.0]),
            life=jnp.array([1.0]),
            u=jnp.array([0.5]),
            contacts=jnp.array([contacts]),
        )
        assert int(new[0]) == level


def test_blind_differs_from_the_teacher_by_the_map_alone():
    blind, teacher = (load_config(LocoConfig, f"loco/{name}") for name in ("blind", "teacher"))
    assert blind.gait == replace(teacher.gait, map=False) and replace(blind, gait=teacher.gait) == teacher
    nothing = load_config(LocoConfig, "loco/no_pretraining")
    assert nothing.from_policy is None and nothing.iterations == teacher.iterations
    assert replace(nothing, from_policy="rough", ppo=teacher.ppo) == teacher


def test_actors_ship_what_they_learned():
    config = load_config(LocoConfig, "loco/teacher")
    settings = training.rsl_rl_settings(config)["actor"]
    assert settings.pop("class_name").endswith(StepModel.__name__)
    observation = TensorDict({"policy": torch.randn(3, STEPPING_MAP_TABLE.size)}, batch_size=[3])
    trained = StepModel(observation, {"actor": ["policy"]}, "actor", 12, **settings)
    network = trained.export()
    shipped = build_network(network.describe())
    shipped.load_state_dict(network.state_dict())
    seen = observation["policy"][:, : STEPPING_TABLE.size]
    assert torch.allclose(trained(observation), shipped(seen), atol=1e-6)
    assert trained(observation).abs().max() < 0.1  # it begins by standing


def pose_feet(block, along: float, across: float, bottom: float) -> np.ndarray:
    """A robot that looks across a block, its left front foot at a place in the block's frame [m], ``bottom`` [m] above
    the ground; beside the block all four feet are level."""
    model = robot_spec("spheres").compile()
    data = mujoco.MjData(model)
    x, y, yaw = block[:3]
    data.qpos[:] = home_qpos(0, 0, 0, yaw + np.pi / 2)
    mujoco.mj_kinematics(model, data)
    foot = data.geom_xpos[model.geom(FOOT_GEOMS[0]).id]
    c, s = np.cos(yaw), np.sin(yaw)
    spot = np.array([x + c * along - s * across, y + s * along + c * across])
    x, y = spot - foot[:2]
    return home_qpos(float(x), float(y), float(bottom + FOOT - foot[2]), float(yaw + np.pi / 2))


def test_feet_and_shanks_on_a_block_are_counted_and_those_beside_it_are_not(env):
    rows = env.terrain.blocks.rows
    apart = [row for row in rows if np.sort(np.linalg.norm(rows[:, :2] - row[:2], axis=1))[1] > 1.2]
    assert len(apart) >= 4
    poses, expected = [], []
    for block in apart[:4]:
        edge, high = block[4] / 2 + FOOT, block[5]
        cases = (
            (0.0, high - 0.002, True),  # stands on it
            (0.0, high + 0.03, False),  # swings over it
            (-edge - 0.03, -0.002, False),  # stands 3 cm before it
            (-edge + 0.004, 0.0, True),  # stands against its side: at least the shank touches its edge
        )
        for across, bottom, touches in cases:
            poses.append(pose_feet(block, 0.0, across, bottom))
            expected.append(touches)
    state = first_state(env)(jax.random.PRNGKey(0))
    n = len(poses)
    body = state.body._replace(qpos=jnp.asarray(np.stack(poses), jnp.float32), qvel=jnp.zeros((n, 18)))
    quiet = {"life": state.life + 1, "step": jnp.zeros(n, jnp.int32), "push_left": jnp.full(n, 99, jnp.int32)}
    env.state = jax.device_put(state._replace(body=body, **quiet), jax.devices()[0])
    env.step(jnp.zeros((n, 12)))
    assert np.asarray(env.state.hits > 0).tolist() == expected
    measures = env.read_measures()
    assert measures["reward/obstacle_contact"] < 0


def test_ghost_blocks_are_judged_and_nothing_to_stand_on(env):
    """A robot above a block falls through it while it is a ghost, and its feet count as touching it."""
    rows, simulation = env.terrain.blocks.rows, env.simulation
    apart = [row for row in rows if np.sort(np.linalg.norm(rows[:, :2] - row[:2], axis=1))[1] > 1.2]
    pose = pose_feet(apart[0], 0.0, 0.0, apart[0][5] + 0.002)
    step, n = jax.jit(simulation.step), env.num_envs
    still = jnp.tile(jnp.asarray(DEFAULT_POSE, jnp.float32), (n, PAST, 1))
    lowest, touched = {}, {}
    compiled = []
    for solid in (True, False):
        simulation.set_solid(solid)
        body = Body(jnp.tile(jnp.asarray(pose, jnp.float32), (n, 1)), jnp.zeros((n, 18)), jnp.zeros((n, 18)))
        body = jax.device_put(body, jax.devices()[0])  # placed like what a step returns: else it is compiled twice
        hit = False
        for _ in range(12):
            body, contacts, _ = step(simulation.ground, body, still, jnp.zeros(n, jnp.int32), plain_traits(n))
            hit = hit or bool(contacts.foot_block[0, 0])
        lowest[solid], touched[solid] = float(foot_positions(np, np.asarray(body.qpos))[0, 0, 2]), hit
        compiled.append(step._cache_size())
    simulation.set_solid(True)
    assert compiled[0] == compiled[1]  # nothing is compiled anew for ghosts
    assert lowest[True] > apart[0][5] and lowest[False] < apart[0][5] and touched[False]


def test_starts_are_clear_of_blocks_and_walls(config):
    terrain = replace(load_config(LocoConfig, "loco/teacher").terrain, levels=6, columns=20)
    ground = build_terrain(terrain)
    corners = np.concatenate([ground.blocks.boxes().corners().reshape(-1, 2), ground.tall.corners().reshape(-1, 2)])
    free = config.randomisation.start_xy + 0.42  # half the standing robot's diagonal is 0.40
    for start in ground.starts.reshape(-1, 3):
        assert np.abs(corners - start[:2]).max(1).min() > free
    assert {"walls", "blocks", "hurdles", "bars", "rough_slope"} <= set(ground.kinds)


def test_the_environment_knows_who_walks_over_blocks(env):
    rows = env.terrain.blocks.rows
    over = np.asarray(env.simulation.block_distance(env.simulation.ground, jnp.asarray(rows[:, :2], jnp.float32)))
    assert (over < 0).all()
    assert np.asarray(env.simulation.block_distance(env.simulation.ground, jnp.zeros((1, 2)) + 1e3)) > 0
    cover = tile_cover(env.terrain)
    assert cover.shape == env.terrain.starts.shape[:2] and (cover[0] == 0).all()
    assert cover.sum() * TILE**2 == pytest.approx((rows[:, 3] * rows[:, 4]).sum(), rel=0.25)
    start = first_state(env)(jax.random.PRNGKey(0))
    level = int(np.argmax(cover[:, 0]))
    qpos = start.body.qpos.at[:, :2].set(jnp.asarray(rows[0, :2], jnp.float32)).at[:, 2].set(1.0)
    state = start._replace(body=start.body._replace(qpos=qpos), level=start.level * 0 + level, column=start.column * 0)
    env.state = jax.device_put(state, jax.devices()[0])
    env.read_measures()
    env.step(jnp.zeros((env.num_envs, 12)))
    expected = 1 / cover[level, 0] if cover[level, 0] * env.num_envs > 1 else env.num_envs
    assert env.read_measures()["trunk_over_blocks"] == pytest.approx(expected, rel=1e-3)
