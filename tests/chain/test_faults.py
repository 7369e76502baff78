"""Faults of motors, body and sensors."""

import numpy as np
import pytest

from vinl.chain.choose import load_navigator
from vinl.chain.config import EvaluationConfig, FaultConfig
from vinl.chain.episode import draw_routes, draw_setup
from vinl.chain.robot import DelayLine, FaultyState, change_body
from vinl.chain.rollout import run_episodes
from vinl.chain.scene import build_scene
from vinl.config.errors import InputError
from vinl.config.loader import load_config
from vinl.policies.policy import LocomotionPolicy
from vinl.robot.aliengo import DEFAULT_POSE, home_qpos
from vinl.robot.rotation import rotate_inverse, yaw_of
from vinl.sensing.sensor_config import SensorConfig
from vinl.world.boxes import Boxes
from vinl.world.clutter import CLUTTER
from vinl.world.floorplan import FloorPlan


def state(n: int = 1, **faults: float) -> FaultyState:
    return FaultyState(FaultConfig(**faults), [np.random.default_rng(k) for k in range(n)])


def test_without_faults_nothing_is_changed():
    assert not FaultConfig().spoils_state
    model = build_scene(Boxes.empty(), Boxes.empty())
    before = model.body_mass.copy(), model.geom_friction.copy(), model.body_invweight0.copy()
    change_body(model, FaultConfig())
    for a, b in zip(before, (model.body_mass, model.geom_friction, model.body_invweight0), strict=True):
        np.testing.assert_array_equal(a, b)
    assert FaultConfig().is_neutral and load_config(EvaluationConfig, "eval/default").faults.is_neutral


def test_neutral_faults_walk_the_same_to_the_last_bit_and_others_do_not(
    trotting: LocomotionPolicy, two_rooms: FloorPlan
):
    config = EvaluationConfig(time_limit=0.6)
    routes = draw_routes(two_rooms, 2, config)

    def walk(sensors: SensorConfig | None = None, **faults: float) -> list[np.ndarray]:
        rules = EvaluationConfig(time_limit=0.6, faults=FaultConfig(**faults), sensors=sensors or SensorConfig())
        setups = [draw_setup(two_rooms, routes[k], k, 0, CLUTTER["paper"], rules) for k in range(2)]
        done = run_episodes(two_rooms, setups, trotting, load_navigator("oracle", rules), rules, filmed=[0, 1])
        return [episode.trace.poses for episode in done]

    plain = walk()
    # so small a tilt of the camera changes nothing that this policy sees, but takes the way of the errors
    for a, b in zip(plain, walk(SensorConfig(pitch=(1e-9, 1e-9))), strict=True):
        np.testing.assert_array_equal(a, b)
    for fault in ({"action_delay": 0.01}, {"kp_scale": 0.8}, {"mass_scale": 1.2}, {"velocity_noise": 0.1}):
        assert any(not np.array_equal(a, b) for a, b in zip(plain, walk(**fault), strict=True)), fault
        for a, b in zip(walk(**fault), walk(**fault), strict=True):
            np.testing.assert_array_equal(a, b)


def test_targets_are_late_by_physics_steps():
    targets = [np.full(12, float(k)) for k in range(4)]
    for late, expected in ((0, [0, 0, 0, 0, 1, 1, 1, 1]), (1, [9, 0, 0, 0, 0, 1, 1, 1]), (6, [9] * 6 + [0, 0])):
        line = DelayLine(late, np.full(12, 9.0))
        sent = [float(t[0]) for target in targets[:2] for t in line.push(target)]
        assert sent == expected, late
    line = DelayLine(8, DEFAULT_POSE)
    assert [float(line.push(target)[0][0]) for target in targets] == [0.1, 0.1, 0.0, 1.0]


def test_a_velocity_bias_changes_over_about_a_second():
    faulty, still = state(40, velocity_bias=0.1), np.zeros((40, 18))
    qpos = np.stack([home_qpos()] * 40)
    errors = np.stack([faulty.measure(qpos, still, range(40))[1][:, :3] for _ in range(300)])
    assert errors.std() == pytest.approx(0.1, rel=0.2)
    for lag, kept in ((1, np.exp(-0.02)), (50, np.exp(-1.0))):
        assert (errors[lag:] * errors[:-lag]).mean() / errors.var() == pytest.approx(kept, abs=0.12)
    white, turned = state(40, velocity_noise=0.1), qpos.copy()
    errors = np.stack([white.measure(turned, still, range(40))[1][:, :3] for _ in range(100)])
    assert errors.std() == pytest.approx(0.1, rel=0.05)
    assert abs((errors[1:] * errors[:-1]).mean()) < 0.002


def test_imu_noise_tilts_gravity_but_turns_no_heading():
    qpos, still = home_qpos(yaw=1.0)[None], np.zeros((1, 18))
    faulty = state(imu_noise=2.0)
    seen = [faulty.measure(qpos, still, [0]) for _ in range(300)]
    gravity = np.stack([rotate_inverse(np, q[:, 3:7], np.array([[0.0, 0.0, -1.0]]))[0] for q, _ in seen])
    assert 0.08 < np.abs(gravity[:, :2]).max() <= 0.11
    assert max(abs(float(yaw_of(np, q[:, 3:7])[0]) - 1.0) for q, _ in seen) < 0.01
    assert 0.3 < np.abs(np.stack([v[0, 3:6] for _, v in seen])).max() <= 0.4
    np.testing.assert_array_equal(qpos[0], home_qpos(yaw=1.0))


def test_what_a_robot_measures_depends_on_its_own_numbers_alone():
    qpos, qvel = np.stack([home_qpos()] * 3), np.zeros((3, 18))
    together, alone = (
        state(3, velocity_bias=0.1, imu_noise=1.0),
        FaultyState(FaultConfig(velocity_bias=0.1, imu_noise=1.0), [np.random.default_rng(2)]),
    )
    for rows in ([0, 1, 2], [1, 2], [2]):
        many, one = together.measure(qpos, qvel, rows), alone.measure(qpos[2:], qvel[2:], [0])
        np.testing.assert_array_equal(many[1][2], one[1][0])
        np.testing.assert_array_equal(many[0][2], one[0][0])


def test_the_body_changes():
    model, heavy = (build_scene(Boxes.empty(), Boxes.empty()) for _ in range(2))
    change_body(heavy, FaultConfig(mass_scale=1.2, friction_scale=0.5))
    np.testing.assert_allclose(heavy.body_mass, 1.2 * model.body_mass)
    np.testing.assert_allclose(heavy.body_inertia, 1.2 * model.body_inertia)
    assert (heavy.body_invweight0[1:14, 0] < model.body_invweight0[1:14, 0]).all()
    foot = model.geom("FL_foot").id
    assert heavy.geom_friction[foot, 0] == 0.5 * model.geom_friction[foot, 0]


@pytest.mark.parametrize("faults", [{"action_delay": 0.003}, {"kp_scale": 0.0}, {"velocity_noise": -0.1}])
def test_faults_that_make_no_sense_are_refused(faults: dict):
    with pytest.raises(InputError, match=f"faults.{next(iter(faults))}"):
        FaultConfig(**faults)
