"""Velocity feedback: the weights do what the formula says."""

import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from vinl.config.errors import InputError
from vinl.policies.card import find_detour
from vinl.policies.depth_policy import DepthPolicy
from vinl.policies.feedback import add_feedback
from vinl.policies.io import load_policy
from vinl.policies.policy import LocomotionPolicy
from vinl.robot.observation import PROPRIOCEPTION_SIZE, STANDARD_SCAN
from vinl.sensing.detour import DetourConfig

GAINS = np.array([0.5, 0.25, 0.1])


def told_more(observation: np.ndarray) -> np.ndarray:
    """The observation with the command [m/s, m/s, rad/s] as the feedback would have it."""
    si = observation / STANDARD_SCAN.scale[: observation.shape[1]]
    velocity = np.concatenate([si[:, 0:2], si[:, 5:6]], 1)
    si[:, 9:12] += GAINS * (si[:, 9:12] - velocity)
    return si * STANDARD_SCAN.scale[: observation.shape[1]]


def test_a_teacher_acts_as_if_the_command_were_larger_by_what_is_missing() -> None:
    before = load_policy("no_pretraining")
    after = LocomotionPolicy(*add_feedback(before, *GAINS))
    observation = np.random.default_rng(0).uniform(-1, 1, (6, STANDARD_SCAN.observation_size))
    np.testing.assert_allclose(after.act(observation), before.act(told_more(observation)), atol=1e-5)
    assert np.abs(after.act(observation) - before.act(observation)).max() > 0.01
    assert after.card.training["feedback"] == {"forward": 0.5, "sideways": 0.25, "yaw_rate": 0.1}
    assert before.card.evaluation and not after.card.evaluation


def test_a_student_does_for_one_and_the_same_code() -> None:
    before = load_policy("loco")
    assert isinstance(before, DepthPolicy)
    network, _ = add_feedback(before, *GAINS)
    vector = np.random.default_rng(1).uniform(-1, 1, (6, PROPRIOCEPTION_SIZE))
    code = torch.linspace(-1, 1, 6 * before.network.code).reshape(6, -1)
    code[:, 32:] = 0.0  # no detours: the gains are for the bent command
    acts = [
        policy.act(torch.as_tensor(numbers, dtype=torch.float32), code).detach().numpy()  # type: ignore[operator]
        for policy, numbers in ((network, vector), (before.network, told_more(vector)))
    ]
    np.testing.assert_allclose(*acts, atol=1e-5)


def test_what_moves_as_it_should_is_not_asked_for_more() -> None:
    before = load_policy("no_pretraining")
    after = LocomotionPolicy(*add_feedback(before, *GAINS))
    observation = np.random.default_rng(2).uniform(-1, 1, (6, STANDARD_SCAN.observation_size))
    observation[:, 9:11], observation[:, 11] = observation[:, 0:2], observation[:, 5]
    np.testing.assert_allclose(after.act(observation), before.act(observation), atol=1e-5)


@pytest.mark.parametrize("gain", [-0.1, float("nan"), float("inf")])
def test_gains_are_gains(gain: float) -> None:
    with pytest.raises(InputError, match="finite and not negative"):
        add_feedback(load_policy("no_pretraining"), 0.0, gain, 0.0)


def test_who_has_no_use_for_it_is_refused() -> None:
    with pytest.raises(InputError, match="only locomotors"):
        add_feedback(load_policy("nav"), *GAINS)
    policy = load_policy("no_pretraining")
    policy.card = replace(policy.card, training=policy.card.training | {"feedback": {"forward": 1.0}})
    with pytest.raises(InputError, match="has feedback already"):
        add_feedback(policy, *GAINS)


def test_the_script_writes_a_policy_and_refuses_in_one_line(tmp_path: Path) -> None:
    script = Path(__file__).resolve().parents[2] / "scripts" / "tune_locomotor.py"

    def run(*argv: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run([sys.executable, str(script), *argv], capture_output=True, text=True)

    assert (
        run(
            "no_pretraining", "--forward", "0.4", "--detour", "turning=1.7", "--out", str(tmp_path / "quick")
        ).returncode
        == 0
    )
    card = load_policy(tmp_path / "quick").card
    assert card.training["feedback"]["forward"] == 0.4
    assert find_detour(card) == DetourConfig(turning=1.7)
    for argv in (
        ("nav", "--forward", "1"),
        ("teachr",),
        ("no_pretraining", "--yaw-rate", "-1"),
        ("no_pretraining", "--detour", "turnin=1"),
        ("no_pretraining", "--detour", "price=-1"),
        ("loco", "--detour"),
    ):
        refused = run(*argv, "--out", str(tmp_path / "none"))
        assert refused.returncode == 2 and "error:" in refused.stderr and "Traceback" not in refused.stderr
    assert not (tmp_path / "none").exists()
