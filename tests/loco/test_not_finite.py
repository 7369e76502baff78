"""Numbers that are not finite: the robot is set back, counted and saved; the training goes on, or ends with a word."""

from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import torch
from small_tiles import BLOCK_TILES

from vinl.cli.app import main
from vinl.config.loader import load_config
from vinl.loco import training
from vinl.loco.config import LocoConfig
from vinl.loco.environment import LocoEnvironment
from vinl.loco.nan_guard import KEPT
from vinl.loco.replay import LostState, load_lost, replay
from vinl.loco.simulation import delay_steps
from vinl.rl.nan_guard import NotFiniteError, judge_losses
from vinl.rl.run_folder import MAX_LOST, RunFolder
from vinl.robot.aliengo import DEFAULT_POSE

pytestmark = pytest.mark.slow

STAGE2 = ["num_envs=8", *BLOCK_TILES, "ppo.steps=4", "ppo.critic_warmup=1", "terrain.block_density=0.1"]


@pytest.fixture(scope="module")
def env() -> LocoEnvironment:
    return LocoEnvironment(load_config(LocoConfig, "loco/teacher", STAGE2))


@pytest.fixture
def fresh(env, share_environment) -> LocoEnvironment:
    return share_environment(training, env)()


def spoil(monkeypatch, steps: dict[int, list[int]], speed: float = 1e9) -> None:
    """Before the control steps that are keys, a calf of the robots that are named turns at a mad speed [rad/s]."""
    real, count = LocoEnvironment.step, 0

    def step(self: LocoEnvironment, action: jax.Array, gait=None):
        nonlocal count
        for robot in steps.get(count, []):
            body = self.state.body
            body = body._replace(qvel=body.qvel.at[robot, 8].set(speed))
            self.state = jax.device_put(self.state._replace(body=body), jax.devices()[0])
        count += 1
        return real(self, action, gait)

    monkeypatch.setattr(LocoEnvironment, "step", step)


def check_run(folder: Path, arguments: list[str], capsys) -> None:
    """One robot of eight goes wrong in the second iteration: counted, saved, and the training ends well."""
    assert main(["train-loco", "--device", "cpu", "--out", str(folder), *arguments]) == 0
    rows = [line for line in (folder / "metrics.jsonl").read_text().splitlines() if '"not_finite": 1.0' in line]
    assert len(rows) == 1 and '"iteration": 2,' in rows[0]
    assert [f.name for f in (folder / "not_finite").iterdir()] == ["000001.npz"]
    saved = load_lost(folder / "not_finite" / "000001.npz")
    assert (int(saved.values["robot"]), int(saved.values["iteration"])) == (3, 2)
    assert saved.reason in ("physics", "speed") and saved.config.num_envs == 8
    assert np.isfinite(saved.values["qpos"]).all() and saved.values["qvel"][8] == np.float32(1e9)
    capsys.readouterr()


def test_stage_1_sets_the_robot_back_saves_it_and_goes_on(tmp_path, monkeypatch, small_overrides, capsys):
    spoil(monkeypatch, {5: [3]})
    check_run(tmp_path / "run", small_overrides, capsys)


def test_stage_2_the_same_and_play_shows_what_went_wrong(tmp_path, monkeypatch, fresh, walker, capsys):
    run = tmp_path / "run"
    spoil(monkeypatch, {5: [3]})
    check_run(run, ["--stage", "2", "--from", str(walker), *STAGE2], capsys)
    assert np.isfinite(np.asarray(fresh.state.body.qpos)).all()
    file, video = str(run / "not_finite" / "000001.npz"), tmp_path / "film.gif"
    assert main(["replay-nan", "--state", file, "--simulator", "mujoco", "--steps", "1", "--video", str(video)]) == 0
    said = capsys.readouterr().out
    assert "robot 3, iteration 2" in said and "blocks" in said
    assert "FL_calf is 1000000000" in said and video.stat().st_size > 1000


def test_mjx_replays_the_very_step(fresh):
    """Physics step by physics step, the replay ends where the training's control step ends."""
    before, action = jax.tree.map(np.asarray, fresh.state), np.full(12, 0.1, np.float32)
    values = {name: getattr(before.body, name)[2] for name in ("qpos", "qvel", "warmstart")}
    values |= {name: getattr(before, name)[2] for name in ("command", "level", "column", "step")}
    traits = ("friction", "added_mass", "kp", "kd", "joint_friction")
    values |= {name: getattr(before.traits, name)[2] for name in traits}
    target = np.asarray(DEFAULT_POSE, np.float32) + 0.25 * action
    values |= {
        "targets": np.stack([target, *before.targets[2, :2]]),
        "delay": int(delay_steps(jax.numpy.asarray(before.traits.latency))[2]),
    }
    values |= {"action": action, "last_action": before.action[2], "robot": 2, "iteration": 7, "seed": 1}
    fresh.step(jnp.broadcast_to(jnp.asarray(action), (8, 12)))
    played = replay(LostState(values, "physics", fresh.config), 1, "mjx")
    assert played.wrong is None and played.qpos.shape == (5, 19)
    after = fresh.state.body
    assert np.allclose(played.qpos[-1], after.qpos[2], atol=1e-5)
    assert np.allclose(played.qvel[-1], after.qvel[2], atol=1e-2)


def test_actions_rewards_and_observations_count_too(fresh):
    fresh.step(jnp.zeros((8, 12)).at[1, 4].set(jnp.nan))
    assert fresh.read_measures()["not_finite"] == 1
    (lost,) = fresh.take_lost()
    assert (lost["reason"], int(lost["robot"])) == ("action", 1)

    ground = fresh.simulation.ground
    unseen = jax.device_put(ground._replace(heights=jnp.full_like(ground.heights, jnp.nan)), jax.devices()[0])
    fresh.simulation.ground = unseen  # what the scan reads; the physics has its own
    try:
        result = fresh.step(jnp.zeros((8, 12)))
        assert all(np.isfinite(np.asarray(x)).all() for x in jax.tree.leaves(result))
    finally:
        fresh.simulation.ground = ground
    assert fresh.read_measures()["not_finite"] == 0
    result = fresh.step(jnp.zeros((8, 12)))
    assert np.asarray(result.done).all() and (np.asarray(fresh.state.life) == 0).all()
    assert fresh.read_measures()["not_finite"] == 8
    assert {lost["reason"] for lost in fresh.take_lost()} == {"observation"}

    weights = dict(fresh._rewards)
    try:
        fresh._rewards["torque"] = np.float32("inf")
        result = fresh.step(jnp.zeros((8, 12)))
    finally:
        fresh._rewards = weights
    assert np.isfinite(np.asarray(result.reward)).all() and np.asarray(result.done).all()
    assert {lost["reason"] for lost in fresh.take_lost()} == {"reward"}
    fresh.read_measures()
    for _ in range(3):
        fresh.step(jnp.full((8, 12), jnp.nan))
    assert fresh.read_measures()["not_finite"] == 24 and len(fresh.take_lost()) == KEPT


def test_more_than_one_in_a_thousand_ends_the_training(tmp_path, monkeypatch, fresh, walker, capsys):
    run = tmp_path / "run"
    spoil(monkeypatch, {5: [3, 4]})
    assert (
        main(["train-loco", "--device", "cpu", "--stage", "2", "--from", str(walker), *STAGE2, "--out", str(run)]) == 1
    )
    error = capsys.readouterr().err
    lines = [line for line in error.splitlines() if line.startswith("error")]
    assert len(lines) == 1 and "2 of 32 robot steps in iteration 2" in lines[0] and str(run / "not_finite") in lines[0]
    assert torch.load(run / "checkpoint.pt", weights_only=True)["iteration"] == 2
    assert len(list((run / "not_finite").iterdir())) == 2
    assert main(["train-loco", "--device", "cpu", "--resume", str(run)]) == 0  # what is sound goes on


def test_a_policy_that_is_not_finite_does_not_replace_the_checkpoint(tmp_path, monkeypatch, fresh, walker):
    run = tmp_path / "run"
    config = load_config(LocoConfig, "loco/teacher", [*STAGE2, f"from_policy={walker}", "iterations=1"])
    assert training.train_locomotor(config, run)
    before = (run / "checkpoint.pt").read_bytes()
    real = training.TrainingRunner.resume

    def resume_broken(self):
        found = real(self)
        torch.nn.init.constant_(self.alg.get_policy().mlp[0].bias, float("nan"))
        return found

    monkeypatch.setattr(training.TrainingRunner, "resume", resume_broken)
    with pytest.raises(NotFiniteError, match=r"32 of 32 .*action.*checkpoint is old"):
        training.train_locomotor(None, run, iterations=3)
    assert (run / "checkpoint.pt").read_bytes() == before


def test_losses_are_judged_by_their_share_and_few_are_kept(tmp_path):
    class Env:
        def take_lost(self):
            return [{"reason": "physics", "qpos": np.zeros(19)}] * 15

    folder = RunFolder(tmp_path / "run")
    assert judge_losses(Env(), {}, 100, 1, folder) is None and not folder.path.exists()
    assert judge_losses(Env(), {"not_finite": 98.0}, 98_304, 2, folder) is None
    message = judge_losses(Env(), {"not_finite": 99.0}, 98_304, 3, folder)
    assert message is not None and "99 of 98304" in message and "physics" in message
    assert len(list((folder.path / "not_finite").iterdir())) == MAX_LOST


def test_play_refuses_what_is_no_state(tmp_path, capsys):
    broken, other = tmp_path / "broken.npz", tmp_path / "other.npz"
    broken.write_text("nothing")
    np.savez(other, qpos=np.zeros(19))
    for arguments, words in (
        (["--state", str(tmp_path / "none.npz")], "does not exist"),
        (["--state", str(broken)], "no saved state"),
        (["--state", str(other)], "qvel"),
        (["--state", str(other), "--steps", "0"], "--steps"),
        (["--state", str(other), "--video", "film.avi"], ".mp4"),
    ):
        assert main(["replay-nan", *arguments]) == 2
        error = capsys.readouterr().err
        assert words in error and len(error.strip().splitlines()) == 1
