"""``vinl eval --faults``: one fault at a time beside the ideal robot."""

import json
from pathlib import Path

import pytest

from vinl.benchmark.protocol import Row
from vinl.benchmark.table import IDEAL, FaultMatrix
from vinl.chain.config import EvaluationConfig, FaultConfig
from vinl.chain.navigators.oracle import OracleNavigator
from vinl.cli.app import main
from vinl.config.errors import InputError
from vinl.config.loader import load_config
from vinl.policies.io import save_policy
from vinl.policies.policy import LocomotionPolicy
from vinl.sensing.sensor_config import SensorConfig

PLAN = "mill_loft"


@pytest.fixture
def policy(trotting: LocomotionPolicy, tmp_path: Path) -> str:
    return str(save_policy(tmp_path / "trotting", trotting.network, trotting.card))


def walk(policy: str, out: str, *more: str) -> dict:
    options = f"--floorplans {PLAN} --loco {policy} --episodes 1 --seeds 1 --workers 1 --set time_limit=0.5 --out {out}"
    assert main(["eval", *options.split(), *more]) == 0
    return json.loads((Path(out) / "results.json").read_text())


def test_each_fault_walks_the_episodes_of_the_ideal_row(policy: str, capsys: pytest.CaptureFixture[str]) -> None:
    data = walk(policy, "faults", "--faults", "--rows", "kp_0.8", "action_delay_40ms")
    assert list(data["rows"]) == [IDEAL, "action_delay_40ms", "kp_0.8"]
    assert data["rows"]["kp_0.8"]["settings"] == ["faults.kp_scale=0.8"]
    assert data["rows"]["kp_0.8"]["difference"]["episodes"] == 1 and "difference" not in data["rows"][IDEAL]
    shown = capsys.readouterr().out
    assert "action_delay_40ms" in shown and "success %" in shown
    alone = walk(policy, "alone")
    ideal = json.loads(Path(f"faults/{IDEAL}/results.json").read_text())
    assert ideal["episodes"] == alone["episodes"] and ideal["config"] == alone["config"]
    late = json.loads(Path("faults/action_delay_40ms/results.json").read_text())
    assert late["config"]["evaluation"]["faults"]["action_delay"] == 0.04
    assert late["episodes"][0]["start"] == alone["episodes"][0]["start"] and late["episodes"] != alone["episodes"]
    by_setting = walk(policy, "set", "--set", "time_limit=0.5", "faults.action_delay=0.04")
    assert by_setting["episodes"] == late["episodes"] and by_setting["config"] == late["config"]


def test_shipped_matrix_has_every_kind_of_fault_alone() -> None:
    matrix = load_config(FaultMatrix, "eval/faults")
    changed = [setting.partition("=")[0] for (setting,) in matrix.rows.values()]
    assert {f"faults.{name}" for name in vars(FaultConfig())} <= set(changed)
    assert {"sensors.pitch", "sensors.delay", "sensors.noise", "sensors.pixels"} <= set(changed)


def test_a_row_changes_its_settings_alone(trotting: LocomotionPolicy) -> None:
    rules = EvaluationConfig(time_limit=3.0, sensors=SensorConfig(noise=0.02))
    row = Row(trotting, OracleNavigator(), settings=("sensors.pixels=0.05", "faults.kp_scale=0.8"))
    sensors, faults = SensorConfig(noise=0.02, pixels=0.05), FaultConfig(kp_scale=0.8)
    assert row.apply(rules) == EvaluationConfig(time_limit=3.0, sensors=sensors, faults=faults)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ("--faults --table", "--faults does not go with"),
        ("--faults --rows kp_0.9", "did you mean 'kp_0.8'"),
        ("--faults --faults-file nowhere.yaml", "nowhere.yaml"),
        ("--faults --set faults.kp_scale=0.8", "leave the group faults"),
        ("--set faults.kp_scale=0", "faults.kp_scale must lie"),
        ("--set faults.action_delay=0.003", "multiple of 0.005 s"),
        ("--rows kp_0.8", "--faults"),
    ],
)
def test_bad_input_is_one_line(options: str, words: str, policy: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["eval", "--floorplans", PLAN, "--loco", policy, "--out", "a", *options.split()]) == 2
    error = capsys.readouterr().err
    assert error.startswith("error: ") and error.count("\n") == 1 and words in error


def test_names_of_faults_are_names_of_folders() -> None:
    fault = ("faults.kp_scale=0.8",)
    for rows in ({}, {"ideal": fault}, {"../a": fault}, {"a": ()}, {"a": ("faults.kp=1",)}):
        with pytest.raises(InputError, match=r"rows|faults\.kp"):
            FaultMatrix(rows)
