"""Every shipped policy, and that of a run folder, becomes a file that answers as the policy does."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import onnx
import pytest
import torch

from vinl.cli.app import main
from vinl.config.errors import InputError
from vinl.export import policy
from vinl.export.metadata import explain_rows, read_metadata
from vinl.export.parity import LIMIT, ExportedPolicy
from vinl.export.policy import Exported, ParityError, build_model, export_policy
from vinl.gait.observation import SENSED_TABLE
from vinl.policies.card import navigation_card
from vinl.policies.depth_policy import DepthPolicy
from vinl.policies.identity import digest_weights
from vinl.policies.io import list_policies, load_policy, save_policy
from vinl.policies.nav_actor import NavActor
from vinl.robot.aliengo import DEFAULT_POSE, JOINTS
from vinl.robot.cameras import NAVIGATION_CAMERA

OTHERS = sorted({*list_policies()} - {"loco", "nav"})


def check(path: Path, done: Exported, name: str, steps: int):
    parity, about = done.parity, ExportedPolicy(path).about
    assert parity.steps == steps and parity.worst <= LIMIT < parity.largest
    card = load_policy(name).card
    assert (about["kind"], about["name"]) == (card.kind, card.name) and card.name in done.title
    assert about["weights_sha256"] == done.weights == digest_weights(load_policy(name).network)
    assert [row["name"] for row in about["observation"]] == [row["name"] for row in card.observation]
    assert all(row["meaning"] and row["scale"] and row["unit"] for row in about["observation"])
    assert done.inputs["observation"] == (1, card.observation_size)
    assert ("camera" in about) == ("depth" in done.inputs) == (load_policy(name).camera is not None)
    assert done.outputs["action"] == (1, 12 if card.kind == "locomotion" else 2)
    assert ("image_age" in about) == ("age" in done.inputs) == (name == "loco")
    assert [state["input"] for state in about["states"]] == [
        n for n in done.inputs if n not in ("observation", "depth", "age")
    ]


@pytest.mark.parametrize("name", OTHERS)
def test_shipped_policies(name: str):
    steps = 100 if load_policy(name).card.kind == "locomotion" else 40
    check(Path("a.onnx"), export_policy(name, "a.onnx", steps), name, steps)


def test_a_file_is_checked_on_a_thousand_steps_unless_told_otherwise(capsys: pytest.CaptureFixture[str]):
    assert main(["export", "rough"]) == 0
    said = re.search(r"parity +([\d,]+) steps of .* differ by ([\d.e+-]+) at most", capsys.readouterr().out)
    assert said is not None and said[1] == "1,000" and float(said[2]) <= LIMIT == 1e-4


def test_loco(exported: dict[str, tuple[Path, Exported]]):
    path, done = exported["loco"]
    check(path, done, "loco", 100)
    about, policy = ExportedPolicy(path).about, load_policy("loco")
    assert policy.camera is not None
    assert about["joint_names"] == list(JOINTS) and about["default_pose"] == DEFAULT_POSE.tolist()
    assert (about["kp"], about["kd"], about["action_scale"], about["period"]) == (40.0, 2.0, 0.25, 0.02)
    camera = about["camera"]
    assert {key: camera[key] for key in policy.camera.describe()} == policy.camera.describe() | {
        "position": list(policy.camera.position)
    }
    np.testing.assert_allclose(camera["rotation"], policy.camera.rotation())
    said = "give pixels without a return as 0: the network is told where they are"
    assert about["image_preparation"]["missing"] == said


def test_nav(exported: dict[str, tuple[Path, Exported]]):
    path, done = exported["nav"]
    check(path, done, "nav", 40)
    about = ExportedPolicy(path).about
    assert about["forward_speed"] == load_policy("nav").card.action["forward_speed"] and about["period"] == 0.5
    assert about["camera"]["name"] == "navigation"


def test_file_is_sound_and_names_no_file_of_this_machine(exported: dict[str, tuple[Path, Exported]]):
    path, _ = exported["loco"]
    onnx.checker.check_model(path, full_check=True)
    content = path.read_bytes()
    for trace in (b".py", b"site-packages", b"stack_trace", str(Path.home()).encode() + b"/"):
        assert trace not in content


def make_run(folder: Path, seed: int = 0) -> Path:
    """What a training of the navigation policy leaves, before it learned anything."""
    torch.manual_seed(seed)
    network = NavActor("cnn", 24, 32, visual=8, hidden=32, layers=1)
    camera = replace(NAVIGATION_CAMERA, height=24, width=32).describe()
    save_policy(folder / "policy", network, navigation_card("mine", network.describe(), camera))
    (folder / "metrics.jsonl").write_text("")
    return folder


def test_run_folder(capsys: pytest.CaptureFixture[str]):
    run = make_run(Path("runs/mine"))
    assert main(["export", str(run), "--steps", "8"]) == 0
    said, path = capsys.readouterr().out, Path("mine.onnx")
    assert "navigation policy mine" in said and "8 steps of" in said and "ms a step" in said
    assert "hidden (1, 1, 32)" in said and "hidden_next (1, 1, 32)" in said
    network = load_policy(run)
    observation, depth = np.full((1, 5), 0.1, np.float32), np.full((1, 24, 32), 0.7, np.float32)
    file = ExportedPolicy(path)
    for _ in range(3):
        np.testing.assert_allclose(file.act(observation[0], depth[0]), network.act(observation, depth)[0], atol=1e-5)


def test_a_file_that_answers_otherwise_is_not_written(monkeypatch: pytest.MonkeyPatch, capsys):
    def build_another(loaded: DepthPolicy):
        return build_model(load_policy(make_run(Path("runs/other"), seed=1)))

    monkeypatch.setattr(policy, "build_model", build_another)
    run = make_run(Path("runs/mine"))
    with pytest.raises(ParityError, match="differ from those of mine by"):
        export_policy(run, "mine.onnx", 8)
    assert main(["export", str(run), "--steps", "8"]) == 1
    assert "nothing was written" in capsys.readouterr().out
    assert {path.name for path in Path().iterdir()} == {"runs"}


def test_a_gait_is_an_input_and_an_output(exported: dict[str, tuple[Path, Exported]]):
    """With the whole planner of footholds in the file, and a second episode that knows nothing of the first."""
    file, loaded = ExportedPolicy(exported["loco"][0]), load_policy("loco")
    assert isinstance(loaded, DepthPolicy) and loaded.camera is not None
    states = {state["input"]: (state["shape"], state["start"]) for state in file.about["states"]}
    assert states == {
        "hidden": ([2, 1, 256], 0.0),
        "cell": ([2, 1, 256], 0.0),
        "gait": ([1, 1, 40], 0.0),
        "velocity": ([1, 1, 3], 0.0),
        "pose": ([1, 1, 3], 0.0),
        "heights": ([1, 1, 12544], -10.0),
        "recent": ([1, 1, 8, 13], 0.0),
        "begun": ([1, 1], 0.0),
    }
    random = np.random.default_rng(0)
    still = np.zeros(SENSED_TABLE.size)
    still[5], still[6] = -1.0, 1.0  # gravity, commanded forward speed 0.5 m/s
    for _ in range(2):  # episodes
        loaded.reset(1)
        file.reset()
        for _ in range(20):
            observation = (still + 0.05 * random.normal(size=len(still))).astype(np.float32)
            depth = random.uniform(0.3, 3.0, (loaded.camera.height, loaded.camera.width)).astype(np.float32)
            age = float(random.uniform(0.0, 0.04))
            wanted = loaded.act(observation[None], depth[None], np.array([age], np.float32))[0]
            np.testing.assert_allclose(file.act(observation, depth, age), wanted, atol=LIMIT)


def test_rows_explain_themselves():
    assert explain_rows([{"name": "x", "size": 3, "meaning": "mine"}]) == [{"name": "x", "size": 3, "meaning": "mine"}]
    with pytest.raises(InputError, match="'projected_gravty' means, did you mean 'projected_gravity'"):
        explain_rows([{"name": "projected_gravty", "size": 3}])
    table = read_metadata({"observation": "[]"})
    assert table == {"observation": []}


@pytest.mark.parametrize(
    ("argv", "says"),
    [
        ("export", "give a policy"),
        ("export loco --scene harbour_flat", "give a policy"),
        ("export lco", "did you mean 'loco'"),
        ("export loco --out loco.pt", "must end with .onnx"),
        ("export loco --out folder.onnx", "is a folder"),
        ("export loco --out file/loco.onnx", "cannot write file/loco.onnx"),
        ("export loco --steps 0", "steps must be at least 1"),
        ("export --scene harbour_flt --out home", "shipped plans"),
        ("export --scene harbour_flat --out file/home", "--out file/home: file is a file"),
        ("export --scene harbour_flat --out home --obstacles some", "obstacles 'some' is not a preset"),
        ("export --scene harbour_flat --out home --episodes 0", "episodes must be at least 1"),
        ("export --scene harbour_flat --out home --seed -1", "seed must not be negative"),
        ("export --scene harbour_flat --out home --resolution 9", "--resolution 9: give metres per pixel"),
    ],
)
def test_bad_input_is_one_line(argv: str, says: str, capsys: pytest.CaptureFixture[str]):
    Path("file").write_text("")
    Path("folder.onnx").mkdir()
    assert main(argv.split()) == 2
    said = capsys.readouterr()
    assert said.err.count("\n") == 1 and says in said.err and not said.out
    assert {path.name for path in Path().iterdir()} == {"file", "folder.onnx"}


def test_without_the_extra(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]):
    monkeypatch.setattr(policy, "find_spec", lambda name: None if name == "onnxruntime" else object())
    assert main(["export", "loco"]) == 2
    assert capsys.readouterr().err == 'error: export needs onnxruntime; install it: pip install "vinl[export]"\n'
