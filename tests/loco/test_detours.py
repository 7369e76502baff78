"""Trainings with bent commands: what the policy is given, what rewards hold it to, what a student makes of it."""

import json
from dataclasses import asdict, replace
from pathlib import Path

import jax.numpy as jnp
import numpy as np
import pytest
import torch
from small_tiles import BLOCK_TILES, SMALL_STUDENT

from vinl.cli.app import main
from vinl.config.errors import InputError
from vinl.config.loader import load_config
from vinl.evaluation.grounds import FieldScan
from vinl.evaluation.senses import Senses, check_senses
from vinl.loco import student, training
from vinl.loco.config import LocoConfig
from vinl.loco.environment import LocoEnvironment
from vinl.loco.warm_start import load_teacher, take_over_student
from vinl.policies.card import find_detour, locomotion_card
from vinl.policies.depth_actor import DepthActor
from vinl.policies.depth_policy import DepthPolicy
from vinl.policies.io import load_policy, save_policy
from vinl.robot.cameras import LOCOMOTION_CAMERA
from vinl.robot.observation import STANDARD_SCAN
from vinl.sensing.detour import DetourConfig

SMALL = ["num_envs=16", *BLOCK_TILES, "terrain.rooms=0", "curriculum.first_level=1", "terrain.first_height=null"]
PPO = ["ppo.steps=4", "ppo.critic_warmup=1"]
COMMAND = slice(9, 12)


@pytest.fixture(scope="module")
def env() -> LocoEnvironment:
    return LocoEnvironment(load_config(LocoConfig, "loco/teacher_detour", [*SMALL, *PPO, "terrain.block_density=4"]))


@pytest.fixture(scope="module")
def sighted() -> LocoEnvironment:
    return LocoEnvironment(load_config(LocoConfig, "loco/student_detour", ["detour.price=0.3", *SMALL, *SMALL_STUDENT]))


@pytest.fixture
def trained(env: LocoEnvironment, share_environment, tmp_path: Path) -> str:
    share_environment(training, env)
    command = ["train-loco", "--config", "loco/teacher_detour", "--from", "teacher", "--device", "cpu", *SMALL, *PPO]
    assert main([*command, "--iterations", "1", "--out", str(tmp_path / "bent")]) == 0
    return str(tmp_path / "bent")


def test_actor_and_critic_are_given_the_command_that_the_evaluation_bends(env: LocoEnvironment) -> None:
    for _ in range(3):
        env.step(jnp.zeros((16, 12)))
    command, qpos = np.asarray(env.state.command), np.asarray(env.state.body.qpos)
    noisy, exact = (np.asarray(x) for x in env.observe())
    scan = FieldScan(env.terrain.ground, STANDARD_SCAN, env.config.detour)
    bent = scan.bend(qpos, command) * STANDARD_SCAN.scale[COMMAND]
    assert np.isclose(exact[:, COMMAND], bent, atol=1e-4).all(1).mean() > 0.85
    assert (noisy[:, COMMAND] == exact[:, COMMAND]).all()
    detoured = np.abs(exact[:, COMMAND] - command * STANDARD_SCAN.scale[COMMAND]).max(1) > 1e-3
    assert detoured.sum() >= 1 and (exact[:, 9] == 2 * command[:, 0]).all()


def test_rewards_hold_the_robot_to_the_command_itself(env: LocoEnvironment) -> None:
    old = env.state.body
    still = old._replace(qvel=jnp.zeros_like(old.qvel))
    contacts = env.simulation.step(
        env.simulation.ground, old, jnp.zeros((16, 12)), env.state.friction, env.state.added_mass
    )[1]
    motion, _ = env._motion(env.state, still, contacts, jnp.zeros((16, 12)), jnp.zeros((16, 12)), jnp.zeros(16, bool))
    assert (motion.command == env.state.command).all()


def test_a_student_is_given_the_plain_command_and_its_teacher_the_bent_one(sighted: LocoEnvironment) -> None:
    noisy, exact = (np.asarray(x) for x in sighted.observe())
    np.testing.assert_allclose(
        noisy[:, COMMAND], np.asarray(sighted.state.command) * STANDARD_SCAN.scale[COMMAND], atol=1e-6
    )
    assert np.abs(exact[:, COMMAND] - noisy[:, COMMAND]).max() > 1e-3
    assert (exact[:, 9] == noisy[:, 9]).all()


def test_a_policy_keeps_its_detour_and_is_evaluated_with_it(trained: str) -> None:
    policy = load_policy(trained)
    assert find_detour(policy.card) == DetourConfig() and policy.card.training["detour"] == asdict(DetourConfig())
    assert main(["train-loco", "--device", "cpu", "--resume", trained, "--iterations", "2"]) == 0
    short = "--robots 4 --seconds 2 --workers 1 --terrain blocks --density 3"
    for name, out in ((trained, "bent"), ("rough", "plain")):
        assert main(["eval-loco", "--policy", name, *short.split(), "--out", out]) == 0
        assert json.loads(Path(out, "results.json").read_text())


def test_senses_bend_the_command_only_for_a_policy_that_wants_it(env: LocoEnvironment, trained: str) -> None:
    qpos, qvel = np.asarray(env.state.body.qpos), np.asarray(env.state.body.qvel)
    command, last = np.asarray(env.state.command), np.zeros((16, 12), np.float32)
    field, policy = env.terrain.ground, load_policy(trained)
    answers = [
        Senses(policy, FieldScan(field, STANDARD_SCAN, detour), None).act(qpos, qvel, command, last)
        for detour in (None, env.config.detour)
    ]
    bent = np.abs(FieldScan(field, STANDARD_SCAN, env.config.detour).bend(qpos, command) - command).max(1) > 0
    differ = np.abs(answers[0] - answers[1]).max(1) > 1e-4
    assert bent.any() and (differ == bent).all()


def test_a_student_learns_the_detour_and_goes_on(
    trained: str, sighted: LocoEnvironment, share_environment, tmp_path: Path
) -> None:
    share_environment(student, sighted)
    command = ["train-loco", "--config", "loco/student_detour", "--from", trained, "--device", "cpu", *SMALL]
    run = str(tmp_path / "student")
    assert main([*command, *SMALL_STUDENT, "student.start=null", "--iterations", "1", "--out", run]) == 0
    assert main(["train-loco", "--device", "cpu", "--resume", run, "--iterations", "2"]) == 0
    policy = load_policy(run)
    assert policy.card.network["detour"] is True and policy.network.head.out_features == 34
    assert find_detour(policy.card) is None and policy.card.training["detour"] == asdict(DetourConfig())


def test_a_detour_in_the_code_acts_as_a_bent_command() -> None:
    torch.manual_seed(0)
    actor = DepthActor(height=18, width=32, detour=True)
    vector, code, bent = torch.randn(5, 48), torch.randn(5, 34), torch.randn(5, 48)
    bent[:, :10], bent[:, 12:] = vector[:, :10], vector[:, 12:]
    code[:, 32:] = actor.read_detour(vector, bent)
    none = torch.cat([code[:, :32], torch.zeros(5, 2)], 1)
    torch.testing.assert_close(actor.act(vector, code), actor.act(bent, none))
    assert (actor.act(vector, code) - actor.act(vector, none)).abs().max() > 1e-3
    # 0.1 m/s to the left and 0.1 rad/s are one each
    moved = vector.clone()
    moved[:, 10] += 0.1 * 2.0
    moved[:, 11] += 0.1 * 0.25
    torch.testing.assert_close(actor.read_detour(vector, moved), torch.ones(5, 2))


def test_an_old_student_goes_on_without_detours_at_first(tmp_path: Path) -> None:
    config = load_config(LocoConfig, "loco/student_detour")
    old = DepthActor(height=18, width=32)
    camera = replace(LOCOMOTION_CAMERA, width=32, height=18)
    card = locomotion_card("old", old.describe(), scan=None, camera=camera.describe())
    save_policy(tmp_path / "old", old, card)
    new = DepthActor(height=18, width=32, detour=True)
    take_over_student(str(tmp_path / "old"), new, config)
    torch.manual_seed(0)
    depth, vector = torch.rand(2, 3, *old.image), torch.randn(2, 3, 48)
    state, fresh = old.initial_state(3), torch.zeros(2, 3, dtype=torch.bool)
    with torch.no_grad():
        mine, theirs = new(depth, vector, state, fresh)[0], old(depth, vector, state, fresh)[0]
    torch.testing.assert_close(mine, theirs)


def test_a_teacher_of_other_detours_is_refused(trained: str) -> None:
    assert load_teacher(trained, load_config(LocoConfig, "loco/student"))[2] == DetourConfig()
    other = load_config(LocoConfig, "loco/student_detour", ["detour.price=0.5"])
    with pytest.raises(InputError, match=r"commands are bent otherwise .*\(detour\.ahead=2\.4 .*detour\.price=0\.3"):
        load_teacher(trained, other)
    with pytest.raises(InputError, match=r"take detour out of the config.*\(none\)"):
        load_teacher("rough", other)
    with pytest.raises(InputError, match=r"detour\.margin"):
        load_config(LocoConfig, "loco/teacher_detour", ["detour.margin=-1"])


def test_a_policy_that_sees_no_ground_cannot_ask_for_detours() -> None:
    policy = load_policy("loco")
    rows = [row | {"detour": {}} if row["name"] == "command" else row for row in policy.card.observation]
    with pytest.raises(InputError, match="observes the height scan"):
        check_senses(DepthPolicy(policy.network, replace(policy.card, observation=rows)))
