"""Stage 3: it runs and goes on after a stop, refuses teachers that are none, and learns what it is shown."""

import json
import math
import shutil
from dataclasses import replace

import jax
import numpy as np
import pytest
import torch
from small_tiles import BLOCK_TILES, SMALL_STUDENT
from tensordict import TensorDict

from vinl.cli.app import main
from vinl.config.errors import InputError
from vinl.config.loader import load_config
from vinl.gait.config import GaitConfig
from vinl.gait.observation import SENSED_TABLE, STEPPING_MAP_TABLE
from vinl.loco import student as stage3
from vinl.loco.config import LocoConfig
from vinl.loco.distillation import Distillation
from vinl.loco.environment import LocoEnvironment
from vinl.loco.student_config import DistillationConfig, NetworkConfig, StudentConfig
from vinl.policies.card import locomotion_card
from vinl.policies.depth_policy import DepthPolicy
from vinl.policies.io import load_policy, save_policy
from vinl.policies.networks import StepActor
from vinl.rl.stopwatch import Stopwatch

pytestmark = pytest.mark.slow

SMALL = ["num_envs=16", *BLOCK_TILES, *SMALL_STUDENT]


@pytest.fixture(scope="module")
def env() -> LocoEnvironment:
    return LocoEnvironment(load_config(LocoConfig, "loco/student", SMALL))


@pytest.fixture
def compiled_once(env, share_environment) -> None:
    share_environment(stage3, env)


def read_rows(folder):
    return [json.loads(line) for line in (folder / "metrics.jsonl").read_text().splitlines()]


def learned(folder):
    return torch.load(folder / "checkpoint.pt", weights_only=True)["algorithm"]["student"]


def test_it_trains_and_a_resumed_run_ends_with_the_very_same_weights(tmp_path, compiled_once, walker):
    straight, stopped, teacher = tmp_path / "straight", tmp_path / "stopped", tmp_path / "teacher"
    shutil.copytree(walker, teacher)
    steady = [f"student.distillation.{x}" for x in ("last_learning_rate=1e-3", "warmup=0", "teacher_share=0")]
    command = ["train-loco", "--stage", "3", "--device", "cpu", "--from", str(teacher), *SMALL, *steady]
    assert main([*command, "--out", str(straight)]) == 0
    rows = read_rows(straight)
    assert [row["iteration"] for row in rows] == [1, 2, 3]
    assert all(np.isfinite(list(row.values())).all() for row in rows)
    assert rows[-1]["samples"] == 3 * 16 * 4 and 0 < rows[0]["loss/velocity_rmse"] < 2
    assert {"seconds/simulate", "seconds/render", "seconds/network", "seconds/update"} <= set(rows[1])

    policy = load_policy(straight)
    assert isinstance(policy, DepthPolicy) and policy.camera is not None
    assert (policy.camera.width, policy.camera.height) == (32, 18)
    assert policy.card.training["origin"]["policy"] == "walker" and policy.card.samples == 192
    assert policy.card.observation == SENSED_TABLE.describe()
    frozen = load_policy(walker).network.state_dict()
    assert all(torch.equal(w, frozen[k]) for k, w in policy.network.state_dict().items() if k.startswith("actor."))
    standing = np.zeros((2, 45), np.float32)
    standing[:, 5] = -1.0  # gravity
    action = policy.act(standing, np.ones((2, 18, 32), np.float32))
    assert action.shape == (2, 12) and np.isfinite(action).all()

    assert main([*command, "--out", str(stopped), "--iterations", "2"]) == 0
    shutil.rmtree(teacher)  # to resume needs nothing of the teacher that it started from
    assert not all(torch.equal(learned(straight)[name], weight) for name, weight in learned(stopped).items())
    assert main(["train-loco", "--device", "cpu", "--resume", str(stopped), "--iterations", "3"]) == 0
    assert all(torch.equal(learned(straight)[name], weight) for name, weight in learned(stopped).items())
    assert [row["iteration"] for row in read_rows(stopped)] == [1, 2, 3]


def test_a_robot_that_goes_wrong_is_set_back_and_saved(tmp_path, compiled_once, walker, monkeypatch):
    step, count = LocoEnvironment.step, 0

    def spoiled(self, action, gait=None):
        nonlocal count
        count += 1
        if count == 6:  # in the second iteration of four steps
            body = self.state.body
            body = body._replace(qvel=body.qvel.at[3, 8].set(1e9))
            self.state = jax.device_put(self.state._replace(body=body), jax.devices()[0])
        return step(self, action, gait)

    monkeypatch.setattr(LocoEnvironment, "step", spoiled)
    command = ["train-loco", "--stage", "3", "--device", "cpu", "--from", str(walker), *SMALL]
    assert main([*command, "--out", str(tmp_path / "run")]) == 0
    rows = read_rows(tmp_path / "run")
    assert [row["not_finite"] for row in rows] == [0, 1, 0]
    assert all(np.isfinite(list(row.values())).all() for row in rows)
    assert [file.name for file in (tmp_path / "run" / "not_finite").iterdir()] == ["000001.npz"]


def test_policies_that_cannot_teach_are_refused(tmp_path, capsys):
    student = tmp_path / "student"
    sees = stage3.build_student(StudentConfig(), StepActor(), GaitConfig())
    camera = StudentConfig().camera.record().describe()
    save_policy(student, sees, locomotion_card("student", sees.describe(), table=SENSED_TABLE, camera=camera))
    for folder, words in (("nav", "navigation policy"), (student, "a student itself"), (tmp_path / "none", "unknown")):
        command = ["train-loco", "--stage", "3", "--device", "cpu", "--from", str(folder), "--out", "out"]
        assert main(command) == 2
        error = capsys.readouterr().err
        assert words in error and len(error.strip().splitlines()) == 1
        assert not (tmp_path / "out").exists()
    assert main(["train-loco", "--stage", "3", "--device", "cpu", "--out", "out", "from_policy=null"]) == 2
    assert "needs a teacher" in capsys.readouterr().err
    assert main(["train-loco", "--stage", "2", "--device", "cpu", "--from", str(student), "--out", "out"]) == 2
    assert len(capsys.readouterr().err.strip().splitlines()) == 1


@pytest.mark.parametrize(
    "wrong",
    ["bptt=5", "learning_rate=0", "teacher_share=2", "minibatches=0", "max_grad_norm=0"],
)
def test_bad_settings_are_refused(wrong):
    with pytest.raises(InputError, match=wrong.split("=")[0]):
        load_config(LocoConfig, "loco/student", [f"student.distillation.{wrong}"])


def test_the_stage_decides_about_the_student():
    student = load_config(LocoConfig, "loco/student").student
    assert student is not None
    assert load_config(LocoConfig, "loco/mlp").student == replace(
        student, network=replace(student.network, memory="mlp")
    )
    with pytest.raises(InputError, match="stage 3"):
        load_config(LocoConfig, "loco/teacher", ["student.camera.width=32"])


def observe_standing(n: int) -> TensorDict:
    """Robots that stand about as they should, on ground that is random."""
    policy = 0.05 * torch.randn(n, STEPPING_MAP_TABLE.size)
    policy[:, 8] -= 1.0  # gravity
    truth = {"heights": torch.full((n, 741), 0.05), "velocity": torch.zeros(n, 3), "age": torch.zeros(n)}
    truth["velocity"] += torch.tensor([0.4, -0.2, 0.1]) + 0.02 * torch.randn(n, 3)
    return TensorDict({"policy": policy, "depth": torch.rand(n, 18, 32).half(), **truth}, batch_size=[n])


def roll_out(algorithm: Distillation, n: int, steps: int) -> None:
    """Steps of random numbers: nothing but the learner is looked at."""
    with torch.inference_mode():
        for k in range(steps):
            batch = observe_standing(n)
            algorithm.act(batch)
            done = torch.zeros(n, dtype=torch.uint8)
            done[k % n] = 1
            algorithm.process_env_step(batch, torch.zeros(n), done, {})
        algorithm.compute_returns(batch)


def learner(memory: str = "lstm", n: int = 6, **settings) -> Distillation:
    torch.manual_seed(0)
    config = StudentConfig(
        network=NetworkConfig(hidden=32, memory=memory, remember=5),
        camera=replace(StudentConfig().camera, width=32, height=18),
        distillation=DistillationConfig(**{"steps": 8, "bptt": 4, "minibatches": 2, **settings}),
    )
    teacher = StepActor(actor=(16,))
    student = stage3.build_student(config, teacher, GaitConfig())
    return Distillation(student, teacher, config.distillation, n, "cpu", Stopwatch("cpu"))


def test_the_loss_falls_on_a_roll_out_and_the_actor_stays():
    algorithm = learner(learning_rate=3e-3, warmup=0.0, epochs=10)
    actor = {name: w.clone() for name, w in algorithm.student.actor.state_dict().items()}
    roll_out(algorithm, 6, 8)
    first = algorithm.update()
    for _ in range(4):
        last = algorithm.update()
    assert last["velocity_rmse"] < 0.9 * first["velocity_rmse"]
    assert first["map_error"] > 0 == last["map_error"]  # of the roll-out that was new
    assert all(torch.equal(w, actor[k]) for k, w in algorithm.student.actor.state_dict().items())


@pytest.mark.parametrize("memory", ["lstm", "mlp"])
def test_windows_begin_with_the_memory_that_the_roll_out_had(memory):
    """Without an update in between, the windows say what the roll-out said, whatever their length."""
    errors = []
    for bptt in (1, 2, 8):
        algorithm = learner(memory, bptt=bptt)
        torch.manual_seed(1)
        roll_out(algorithm, 6, 8)
        roll_out(algorithm, 6, 8)  # the second begins with what the first left
        errors.append(algorithm.loss(torch.arange(6)).item())
    assert np.allclose(errors, errors[0], rtol=1e-5)


def test_some_robots_are_told_the_truth_in_the_beginning():
    algorithm = learner(n=4)
    algorithm.teacher_fraction = 0.5
    batch = observe_standing(4)
    with torch.inference_mode():
        algorithm.act(batch)
    believed = algorithm.student.unpack(algorithm._state).velocity
    same = torch.isclose(believed, batch["velocity"], atol=1e-6).all(1)
    assert same.tolist() == [True, True, False, False]
    assert algorithm.gait().phases.shape == (4, 4)


def test_schedules():
    config = DistillationConfig(
        learning_rate=1e-3, last_learning_rate=1e-5, warmup=0.1, teacher_share=0.8, teacher_until=0.5
    )
    rates = [config.rate_at(s) for s in (0.0, 0.1, 0.5, 1.0)]
    assert rates[0] < 1e-4 < rates[1] and rates[2] == pytest.approx(5.05e-4) and rates[3] == pytest.approx(1e-5)
    assert [config.teacher_fraction_at(s) for s in (0.0, 0.25, 0.5, 0.9)] == pytest.approx([0.8, 0.4, 0.0, 0.0])
    assert DistillationConfig(teacher_until=0.0).teacher_fraction_at(0.0) == 0.0


def test_cells_that_are_told_to_remember_do():
    """The gradient from the last step reaches back some twenty steps."""
    reach = []
    for steps in (0, 50):
        torch.manual_seed(0)
        config = StudentConfig(network=NetworkConfig(remember=steps))
        student = stage3.build_student(config, StepActor(), GaitConfig())
        inputs = torch.randn(25, 1, student.vector_size, requires_grad=True)
        network = student.unpack(student.initial_state(1)).network
        said, _ = student.estimate(inputs, network, torch.zeros(25, 1).bool())
        said[-1].norm().backward()
        assert inputs.grad is not None
        norms = inputs.grad.norm(dim=2)[:, 0]
        reach.append((norms[0] / norms[-1]).item())
    assert reach[0] < 1e-3 < 1e-2 < reach[1] and math.isfinite(reach[1])
