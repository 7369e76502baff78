"""Points 5 cm apart that reach 1.6 m ahead, and others about the feet: trained with, evaluated, taught with."""

import json
import shutil
from pathlib import Path

import jax.numpy as jnp
import numpy as np
import pytest
import torch
from small_tiles import BLOCK_TILES, SMALL_STUDENT
from torch.nn.functional import linear

from vinl.cli.app import main
from vinl.config.errors import InputError
from vinl.config.loader import load_config
from vinl.loco import student, training
from vinl.loco.config import LocoConfig
from vinl.loco.environment import LocoEnvironment
from vinl.loco.warm_start import load_warm_start
from vinl.policies.card import locomotion_card
from vinl.policies.io import find_policy, load_policy, save_policy
from vinl.policies.networks import BlindActor, MapActor, mlp
from vinl.robot.aliengo import home_qpos
from vinl.robot.observation import STANDARD_SCAN, HeightScan, describe, observe
from vinl.sensing.height_scan import scan_ground
from vinl.world.grid import GridFrame
from vinl.world.readers import shipped_floorplans

SCAN = HeightScan(0.05, 1.6, feet=True)
SMALL = [
    "scan_spacing=0.05",
    "scan_ahead=1.6",
    "scan_feet=true",
    "num_envs=16",
    *BLOCK_TILES,
    "terrain.joined=0",
    "terrain.tall_density=0",
    "terrain.row_density=0",
]
PPO = ["ppo.steps=4", "ppo.critic_warmup=1"]
STUDENT = [*SMALL_STUDENT, "student.network.hidden=16"]


@pytest.fixture(scope="module")
def config() -> LocoConfig:
    return load_config(LocoConfig, "loco/teacher_step", [*SMALL, *PPO])


@pytest.fixture(scope="module")
def env(config: LocoConfig) -> LocoEnvironment:
    return LocoEnvironment(config)


@pytest.fixture
def compiled_once(env, share_environment) -> None:
    share_environment(training, env)
    share_environment(student, env)


def untrained(folder: Path, scan: HeightScan) -> Path:
    """An untrained policy that reads this scan."""
    network = MapActor(scan=scan.size)
    return save_policy(folder / f"untrained-{scan.size}", network, locomotion_card("x", network.describe(), scan=scan))


@pytest.fixture
def other(tmp_path: Path) -> Path:
    return untrained(tmp_path, SCAN)


@pytest.fixture
def coarse_run(tmp_path: Path) -> Path:
    """``rough`` with a critic, as its training left it."""
    folder = tmp_path / "coarse"
    shutil.copytree(find_policy("rough"), folder / "policy")
    critic = mlp([STANDARD_SCAN.observation_size, 512, 256, 128, 1], torch.nn.ELU).state_dict()
    critic = {f"mlp.{name}": weight for name, weight in critic.items()}
    torch.save({"algorithm": {"critic_state_dict": critic}}, folder / "checkpoint.pt")
    return folder


def seen_by_both(n: int = 64) -> tuple[np.ndarray, np.ndarray]:
    """The observations of the same robots on random ground, with the standard scan and with the other one."""
    rng = np.random.default_rng(0)
    frame = GridFrame(-4.0, -4.0, 0.05, (161, 161))
    heights = rng.uniform(-0.5, 0.5, frame.shape)
    qpos = np.stack([home_qpos(*rng.uniform(-2, 2, 2), yaw=rng.uniform(-3, 3)) for _ in range(n)])
    rest = rng.normal(size=(n, 18)), rng.normal(size=(n, 3)), rng.normal(size=(n, 12))
    both = (observe(np, qpos, *rest, scan_ground(np, heights, frame, qpos, scan)) for scan in (STANDARD_SCAN, SCAN))
    old, new = (x.astype(np.float32) for x in both)
    return old, new


def test_actor_and_critic_are_given_each_cell_of_the_ground(env: LocoEnvironment) -> None:
    env.step(jnp.zeros((16, 12)))
    state, field = env.state, env.terrain.ground
    qpos, qvel = np.asarray(state.body.qpos), np.asarray(state.body.qvel)
    ground = scan_ground(np, field.heights, field.frame, qpos, SCAN)
    expected = observe(np, qpos, qvel, np.asarray(state.command), np.asarray(state.action), ground)
    noisy, exact = (np.asarray(x) for x in env.observe())
    # MJX and numpy round sines differently: a point on the border of two cells may fall on either side
    assert exact.shape == (16, SCAN.observation_size) and np.isclose(exact, expected, atol=1e-4).mean() > 0.999
    noise = np.abs(noisy - exact)[:, 48:] / SCAN.noise[48:]
    share = env.config.randomisation.observation_noise
    assert (noise.max(0) > 0.3 * share).all() and noise.max() <= share * 1.001


def test_a_widened_actor_acts_as_before(config: LocoConfig) -> None:
    old, new = seen_by_both()
    rough = load_policy("rough")
    widened = MapActor(scan=SCAN.size)
    widened.load_state_dict(load_warm_start("rough", config).actor)
    with torch.no_grad():
        actions = widened(torch.from_numpy(new)).numpy()
    np.testing.assert_allclose(actions, rough.act(old), atol=1e-5)
    assert np.abs(rough.act(old)).max() > 0.1


def test_a_widened_critic_values_as_before_and_trains(coarse_run: Path, config: LocoConfig, compiled_once) -> None:
    old, new = (torch.from_numpy(x) for x in seen_by_both())
    before = torch.load(coarse_run / "checkpoint.pt", weights_only=True)["algorithm"]["critic_state_dict"]
    start = load_warm_start(str(coarse_run), config)
    assert start.critic is not None and start.origin.critic
    first = start.critic["mlp.0.weight"]
    torch.testing.assert_close(linear(new, first), linear(old, before["mlp.0.weight"]), atol=1e-4, rtol=0)
    command = ["train-loco", "--config", "loco/teacher_step", "--device", "cpu", "--iterations", "1", *SMALL, *PPO]
    assert main([*command, "--from", str(coarse_run), "--out", "run"]) == 0
    after = torch.load("run/checkpoint.pt", weights_only=True)["algorithm"]["critic_state_dict"]["mlp.0.weight"]
    assert 0 < (after - first).abs().max() < 0.05


def test_it_trains_goes_on_and_is_evaluated(tmp_path: Path, compiled_once) -> None:
    run, second = str(tmp_path / "run"), str(tmp_path / "second")
    command = ["train-loco", "--config", "loco/teacher_step", "--device", "cpu", *SMALL, *PPO]
    assert main([*command, "--out", run, "--iterations", "2"]) == 0
    assert main(["train-loco", "--device", "cpu", "--resume", run, "--iterations", "3"]) == 0
    rows = [json.loads(line) for line in (tmp_path / "run" / "metrics.jsonl").read_text().splitlines()]
    assert [row["iteration"] for row in rows] == [1, 2, 3]
    policy = load_policy(run)
    assert policy.card.observation == describe(SCAN) and policy.card.observation_size == SCAN.observation_size
    assert policy.card.training["scan_ahead"] == 1.6
    # from a fine run as it is: while the critic warms up the actor stays
    assert main([*command, "--from", run, "--out", second, "--iterations", "1"]) == 0
    again = load_policy(second).network.state_dict()
    assert all(torch.equal(weight, again[name]) for name, weight in policy.network.state_dict().items())

    short = "--robots 2 --seconds 0.2 --workers 1 --out loco"
    assert main(["eval-loco", "--policy", run, "--terrain", "blocks", *short.split()]) == 0
    home = f"--floorplans {shipped_floorplans()[0]} --nav oracle --episodes 1 --seeds 1 --workers 1 --out home"
    assert main(["eval", "--loco", run, "--set", "time_limit=0.5", *home.split()]) == 0
    assert json.loads(Path("home/results.json").read_text())["aggregate"]["episodes"] == 1


def test_a_student_learns_from_it(other: Path, compiled_once, capsys: pytest.CaptureFixture[str]) -> None:
    command = ["train-loco", "--stage", "3", "--device", "cpu", "--from", str(other), *SMALL, *STUDENT]
    assert main([*command, "--iterations", "1", "--out", "run"]) == 0
    assert load_policy("run").card.observation_size == 48
    assert main(["train-loco", "--device", "cpu", "--resume", "run", "--iterations", "2"]) == 0
    capsys.readouterr()
    assert main([*command, "scan_ahead=0.8", "--out", "other"]) == 2
    error = capsys.readouterr().err
    assert "1217 numbers" in error and f"set {SCAN.settings}" in error and len(error.strip().splitlines()) == 1


def test_a_blind_policy_of_either_scan_is_a_policy(tmp_path: Path, config: LocoConfig) -> None:
    blind = load_config(LocoConfig, "loco/blind", ["scan_spacing=0.05", "scan_ahead=1.6", "scan_feet=true"])
    network = BlindActor()
    folder = save_policy(tmp_path / "blind", network, locomotion_card("blind", network.describe()))
    start = load_warm_start(str(folder), blind).actor
    BlindActor(scan=SCAN.size).load_state_dict(start)
    with pytest.raises(InputError, match="BlindActor"):
        load_warm_start(str(folder), config)


def test_what_does_not_fit_is_refused(other: Path, tmp_path: Path) -> None:
    coarse = load_config(LocoConfig, "loco/teacher_step")
    assert coarse.scan == STANDARD_SCAN
    with pytest.raises(InputError, match=r"scan 1169.*scan 187.*scan_spacing, scan_ahead"):
        load_warm_start(str(other), coarse)
    for value in ("0.07", "0", "-0.1", ".nan"):
        with pytest.raises(InputError, match=r"scan_spacing must be 0.1 or 0.05 m"):
            load_config(LocoConfig, "loco/teacher_step", [f"scan_spacing={value}"])
        with pytest.raises(InputError, match=r"scan_ahead must be 0.8 or 1.6 m"):
            load_config(LocoConfig, "loco/teacher_step", [f"scan_ahead={value}"])
    # it lacks points that the fine one reads, although it has more of them ahead
    with pytest.raises(InputError, match=r"scan 693.*scan 275"):
        load_warm_start(str(untrained(tmp_path, HeightScan(0.05))), load_config(LocoConfig, "loco/teacher_ahead"))
