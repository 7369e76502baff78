"""The mean of two policies."""

import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest
import torch

from vinl.config.errors import InputError
from vinl.policies.average import average_policies
from vinl.policies.card import change_detour, find_detour
from vinl.policies.io import load_policy, save_policy
from vinl.sensing.detour import DetourConfig


def test_weights_lie_between_and_the_card_names_both(tmp_path) -> None:
    first, second = load_policy("rough"), load_policy("teacher")
    network, card = average_policies(first, second, 0.25)
    a, b = first.network.state_dict(), second.network.state_dict()
    for name, tensor in network.state_dict().items():
        torch.testing.assert_close(tensor, 0.75 * a[name] + 0.25 * b[name])
    assert [(part["policy"], part["share"]) for part in card.training["averaged"]] == [
        ("rough", 0.75),
        ("teacher", 0.25),
    ]
    assert card.evaluation == {} and second.card.evaluation
    save_policy(tmp_path / "mean", network, card)
    assert load_policy(tmp_path / "mean").card.training["averaged"] == card.training["averaged"]


def test_detours_may_differ_and_the_second_policys_are_kept() -> None:
    first, second = load_policy("rough"), load_policy("teacher")
    first.card = change_detour(first.card)
    second.card = change_detour(second.card, ["turning=1.7"])
    _, card = average_policies(first, second, 0.5)
    assert find_detour(card) == DetourConfig(turning=1.7)
    assert find_detour(average_policies(second, load_policy("rough"), 0.5)[1]) is None


def test_neither_policy_is_changed() -> None:
    first, second = load_policy("rough"), load_policy("teacher")
    before = {name: tensor.clone() for name, tensor in second.network.state_dict().items()}
    average_policies(first, second, 0.5)
    assert all(torch.equal(tensor, before[name]) for name, tensor in second.network.state_dict().items())


@pytest.mark.parametrize("share", [-0.1, 1.5, float("nan")])
def test_a_share_is_a_share(share: float) -> None:
    with pytest.raises(InputError, match="between 0 and 1"):
        average_policies(load_policy("rough"), load_policy("teacher"), share)


def test_what_differs_in_more_than_weights_has_no_mean() -> None:
    first, second = load_policy("rough"), load_policy("loco")
    with pytest.raises(InputError, match="differ in"):
        average_policies(first, second, 0.5)
    other = load_policy("teacher")
    other.card = replace(other.card, action=other.card.action | {"kp": 1.0})
    with pytest.raises(InputError, match="differ in action"):
        average_policies(first, other, 0.5)


def test_the_script_writes_a_policy_and_refuses_in_one_line(tmp_path: Path) -> None:
    script = Path(__file__).resolve().parents[2] / "scripts" / "average_policies.py"

    def run(*argv: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run([sys.executable, str(script), *argv], capture_output=True, text=True)

    assert run("rough", "teacher", "--out", str(tmp_path / "mean")).returncode == 0
    assert load_policy(tmp_path / "mean").card.training["averaged"][1]["share"] == 0.5
    for argv in (("rough", "loco"), ("rough", "teachr"), ("rough", "teacher", "--share", "2")):
        refused = run(*argv, "--out", str(tmp_path / "none"))
        assert refused.returncode == 2 and "error:" in refused.stderr and "Traceback" not in refused.stderr
    assert not (tmp_path / "none").exists()
