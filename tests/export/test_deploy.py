"""The example walks without vinl and torch, and as the chain does."""

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import mujoco
import numpy as np
import pytest

from vinl.chain.config import EvaluationConfig
from vinl.chain.depth_cameras import open_depth_cameras
from vinl.chain.episode import EpisodeSetup, draw_routes, draw_setups
from vinl.chain.navigators.base import Task
from vinl.chain.navigators.learned import LearnedNavigator
from vinl.chain.robot import Robot
from vinl.chain.rollout import run_episodes
from vinl.chain.scene import build_scene
from vinl.cli.app import main
from vinl.export.policy import Exported
from vinl.policies.io import load_policy
from vinl.robot.cameras import LOCOMOTION_CAMERA
from vinl.robot.observation import observe
from vinl.world.clutter import CLUTTER
from vinl.world.free_space import FreeSpace
from vinl.world.readers import load_floorplan

EXAMPLE = Path(__file__).resolve().parents[2] / "examples" / "deploy"
EPISODE = 6
MODEL_ARRAYS = (
    *("geom_type", "geom_size", "geom_pos", "geom_quat", "geom_contype", "geom_conaffinity", "geom_friction"),
    *("geom_condim", "geom_priority", "geom_solref", "geom_solimp", "geom_group", "geom_bodyid"),
    *("body_pos", "body_quat", "jnt_range", "dof_armature", "dof_damping", "dof_frictionloss"),
    *("actuator_gainprm", "actuator_biasprm", "actuator_forcerange", "exclude_signature"),
)


def draw_setup_of_episode() -> EpisodeSetup:
    plan, config = load_floorplan("harbour_flat"), EvaluationConfig()
    return draw_setups(plan, draw_routes(plan, 10, config), 0, CLUTTER["paper"], config)[EPISODE]


@pytest.fixture
def example(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    monkeypatch.syspath_prepend(str(EXAMPLE))
    import walk_home

    return walk_home


@pytest.fixture
def home() -> Path:
    """A home with one of ten episodes."""
    assert main(["export", "--scene", "harbour_flat", "--out", "home"]) == 0
    tasks = json.loads(Path("home/episodes.json").read_text())
    assert len(tasks["episodes"]) == 10
    tasks["episodes"] = tasks["episodes"][EPISODE : EPISODE + 1]
    Path("home/episodes.json").write_text(json.dumps(tasks))
    return Path("home")


def test_it_is_short():
    files = [EXAMPLE / name for name in ("controllers.py", "walk_home.py")]
    assert sum(len(file.read_text().splitlines()) for file in files) <= 150


@pytest.mark.slow
def test_it_walks_as_the_chain_does_without_vinl_and_torch(home: Path, exported: dict[str, tuple[Path, Exported]]):
    """In a process of its own, in which neither can be imported."""
    code = (
        "import sys, runpy; sys.modules |= dict.fromkeys(['vinl', 'torch', 'warp', 'jax', 'scipy']);"
        f"sys.path.insert(0, {str(EXAMPLE)!r}); sys.argv = ['walk_home.py', *sys.argv[1:]];"
        "runpy.run_path(sys.path[0] + '/walk_home.py', run_name='__main__')"
    )
    command = [sys.executable, "-W", "error", "-c", code, str(home), *(str(exported[n][0]) for n in ("loco", "nav"))]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    _, end, seconds, _, path, *_ = done.stdout.splitlines()[0].split()
    assert end == "success" and done.stdout.splitlines()[1] == "1 of 1 goals reached"

    plan, setup = load_floorplan("harbour_flat"), draw_setup_of_episode()
    navigator = LearnedNavigator(load_policy("nav"))
    (episode,) = run_episodes(plan, [setup], load_policy("loco"), navigator, EvaluationConfig())
    assert episode.record.success
    # who touches something parts from the other: contacts are found in another order
    assert float(seconds) == pytest.approx(episode.record.time_s, abs=1.5)
    assert float(path) == pytest.approx(episode.record.distance_m, abs=1.0)


def test_its_home_is_that_of_the_chain(example: ModuleType, home: Path):
    task = json.loads((home / "episodes.json").read_text())["episodes"][0]
    model, data = example.build_home(home, task, {"kp": 30.0, "kd": 1.5})
    plan, setup = load_floorplan("harbour_flat"), draw_setup_of_episode()
    wanted = build_scene(plan.boxes, setup.blocks.boxes(), kp=30.0, kd=1.5)
    for name in MODEL_ARRAYS:
        np.testing.assert_allclose(getattr(model, name), getattr(wanted, name), atol=1e-5, err_msg=name)
    robot = slice(wanted.body("trunk").id, wanted.body("walls").id)
    np.testing.assert_allclose(model.body_mass[robot], wanted.body_mass[robot])
    for name in ("timestep", "integrator", "cone", "impratio", "iterations", "ls_iterations", "disableflags"):
        assert getattr(model.opt, name) == getattr(wanted.opt, name)
    walker = Robot(wanted)
    walker.spawn(*setup.route.start, setup.yaw, setup.joints)
    np.testing.assert_allclose(data.qpos, walker.qpos, atol=1e-5)


def test_its_cameras_see_what_vinl_sees(example: ModuleType, home: Path, exported: dict[str, tuple[Path, Exported]]):
    locomotion = example.Locomotion(str(exported["loco"][0]))
    task = json.loads((home / "episodes.json").read_text())["episodes"][0]
    model, data = example.build_home(home, task, locomotion.about)
    data.qpos[3:7] = [0.8, 0.05, -0.06, 0.5] / np.linalg.norm([0.8, 0.05, -0.06, 0.5])
    mujoco.mj_forward(model, data)
    plan, setup = load_floorplan("harbour_flat"), draw_setup_of_episode()
    for name in ("loco", "nav"):
        camera = load_policy(name).camera
        assert camera is not None
        about = example.Navigation(str(exported["nav"][0])).about if name == "nav" else locomotion.about
        seen = example.DepthCamera(about["camera"]).look(model, data)
        wanted = open_depth_cameras(plan, [setup.blocks], camera).look(data.qpos[None].copy())[0].numpy()
        # home.xml has six digits: an edge may fall on the other side of a pixel's middle
        assert np.mean(np.abs(seen - wanted) < 2e-3) > 0.995
        assert seen.min() < 0.8 * seen.max()


def catch_inputs(policy, monkeypatch: pytest.MonkeyPatch) -> list[np.ndarray]:
    """Observations that a policy of the example gives its network from now on; its answers are random."""
    given, random, run = [], np.random.default_rng(0), policy.session.run

    class Session:
        def run(self, names, inputs):
            given.append(inputs["observation"][0])
            action, *memory = run(names, inputs)
            return [random.normal(size=action.shape).astype(np.float32), *memory]

    monkeypatch.setattr(policy, "session", Session())
    return given


def test_locomotion_observes_as_vinl_does(example, exported, monkeypatch: pytest.MonkeyPatch):
    policy, random = example.Locomotion(str(exported["loco"][0])), np.random.default_rng(1)
    given, last = catch_inputs(policy, monkeypatch), np.zeros(12)
    for _ in range(4):
        qpos, qvel, command = random.normal(size=19), random.normal(size=18), random.normal(size=3)
        qpos[3:7] /= np.linalg.norm(qpos[3:7])
        turn = np.zeros(9)
        mujoco.mju_quat2Mat(turn, qpos[3:7])
        turn = turn.reshape(3, 3)
        state = qvel[3:6], -turn[2], qpos[7:], qvel[6:]
        target = policy.step(*state, command, np.ones((56, 96)))
        wanted = observe(np, qpos[None], qvel[None], command[None], last[None], np.zeros((1, 187)))[0]
        wanted = wanted[3:48]  # without the velocity of the trunk
        np.testing.assert_allclose(given[-1], wanted, atol=1e-5)
        last = policy.last
        np.testing.assert_allclose(target, np.array(policy.about["default_pose"]) + 0.25 * last)


def test_navigation_observes_as_vinl_does(example, exported, monkeypatch: pytest.MonkeyPatch):
    policy, random = example.Navigation(str(exported["nav"][0])), np.random.default_rng(2)
    given = catch_inputs(policy, monkeypatch)
    wanted: list[np.ndarray] = []

    class Asked:
        """Stands in for the policy inside vinl's navigator, and answers as the example's network did."""

        card, camera = load_policy("nav").card, None

        def reset(self, which):
            pass

        def act(self, observation, depth=None):
            wanted.append(observation[0])
            return policy.last[None]

    navigator = LearnedNavigator(Asked())
    plan = load_floorplan("harbour_flat")
    (route,) = draw_routes(plan, 1, EvaluationConfig())
    navigator.reset([Task(FreeSpace(plan), route)])
    pose, goal = np.array([1.0, 2.0, 3.0]), np.array([-2.0, 4.0])
    for _ in range(4):
        command = policy.step(pose, goal, np.ones((60, 80)))
        to = goal - pose[:2]
        bearing = np.arctan2(to[1], to[0]) - pose[2]
        seen = {"pose": pose[None], "goal": np.array([[np.linalg.norm(to), np.cos(bearing), np.sin(bearing)]])}
        chosen = navigator.act(seen)[0]
        np.testing.assert_allclose(given[-1], wanted[-1], atol=1e-5)
        np.testing.assert_allclose(command, [chosen[0], 0.0, chosen[1]], atol=1e-6)
        pose = pose + random.normal(size=3) * [0.3, 0.3, 1.0]


@pytest.mark.parametrize(("missing", "reads"), [("plane", 0.0), ("fill", 0.0), ("as_is", LOCOMOTION_CAMERA.far)])
def test_depth_images_are_prepared(example: ModuleType, missing: str, reads: float):
    from depth_image import DepthPreparation

    camera = replace(LOCOMOTION_CAMERA, missing=missing)
    about = camera.describe() | {"vfov": 2 * np.arctan(camera.tan_half[1])}
    # a camera with ten times the pixels and some more at each side, that sees a ramp to the left
    fx = 5 * camera.width / camera.tan_half[0]
    wide, high = 10 * camera.width + 160, 10 * camera.height + 120
    prepare = DepthPreparation(about, fx, fx, (wide - 1) / 2, (high - 1) / 2, wide, high)
    left = ((wide - 1) / 2 - np.arange(wide)) / fx
    image = np.broadcast_to(1000 * (1.0 + 0.5 * left), (high, wide)).astype(np.uint16)
    tangents = camera.tan_half[0] * (1 - (2 * np.arange(camera.width) + 1) / camera.width)
    seen = prepare(image, 0.001)
    np.testing.assert_allclose(seen, np.broadcast_to(1.0 + 0.5 * tangents, (camera.height, camera.width)), atol=3e-3)
    blank = prepare(np.zeros((high, wide), np.uint16), 0.001)
    assert (blank == reads).all()
    half = DepthPreparation(about, 2 * fx, 2 * fx, (wide - 1) / 2, (high - 1) / 2, wide, high)
    narrow, row = half(np.ones((high, wide), np.float32)), camera.height // 2
    assert narrow[row, camera.width // 2] == 1.0 and narrow[0, 0] == narrow[row, 0] == reads


def test_time_is_told(example: ModuleType, exported, capsys: pytest.CaptureFixture[str]):
    import time_step

    time_step.main(*(str(exported[name][0]) for name in ("loco", "nav")))
    rows = capsys.readouterr().out.splitlines()
    assert rows[0].startswith("loco") and rows[0].endswith("of 20 ms")
    assert rows[1].startswith("nav") and rows[1].endswith("of 500 ms")


def test_the_ros_node_is_python():
    compile((EXAMPLE / "ros2_node.py").read_text(), "ros2_node.py", "exec")
