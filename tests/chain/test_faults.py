"""Faults of motors, body and sensors."""

import numpy as np
import pytest
import torch

from vinl.chain.faults import DelayLine, FaultConfig, FaultySensors
from vinl.chain.scene import build_scene
from vinl.config.errors import InputError
from vinl.robot.aliengo import DEFAULT_POSE, home_qpos
from vinl.robot.cameras import LOCOMOTION_CAMERA, NAVIGATION_CAMERA
from vinl.robot.rotation import rotate_inverse, yaw_of
from vinl.world.boxes import Boxes


def sensors(n: int = 1, **faults: float) -> FaultySensors:
    return FaultySensors(FaultConfig(**faults), [np.random.default_rng(k) for k in range(n)])


def test_without_faults_nothing_is_changed():
    qpos, qvel, image = home_qpos()[None], np.zeros((1, 18)), torch.rand(1, 4, 5)
    neutral = sensors()
    measured = neutral.measure(qpos, qvel, [0])
    assert measured[0] is qpos and measured[1] is qvel
    assert neutral.spoil(image, LOCOMOTION_CAMERA, [0]) is image
    assert FaultConfig().mount(LOCOMOTION_CAMERA) is LOCOMOTION_CAMERA
    model = build_scene(Boxes.empty(), Boxes.empty())
    before = model.body_mass.copy(), model.geom_friction.copy(), model.body_invweight0.copy()
    FaultConfig().change_body(model)
    for a, b in zip(before, (model.body_mass, model.geom_friction, model.body_invweight0), strict=True):
        np.testing.assert_array_equal(a, b)


def test_targets_are_late_by_physics_steps():
    targets = [np.full(12, float(k)) for k in range(4)]
    for late, expected in ((0, [0, 0, 0, 0, 1, 1, 1, 1]), (1, [9, 0, 0, 0, 0, 1, 1, 1]), (6, [9] * 6 + [0, 0])):
        line = DelayLine(late, np.full(12, 9.0), 4)
        sent = [float(t[0]) for target in targets[:2] for t in line.push(target)]
        assert sent == expected, late
    line = DelayLine(8, DEFAULT_POSE, 4)
    assert [float(line.push(target)[0][0]) for target in targets] == [0.1, 0.1, 0.0, 1.0]


def test_a_velocity_bias_changes_over_about_a_second():
    faulty, still = sensors(40, velocity_bias=0.1), np.zeros((40, 18))
    qpos = np.stack([home_qpos()] * 40)
    errors = np.stack([faulty.measure(qpos, still, range(40))[1][:, :3] for _ in range(300)])
    assert errors.std() == pytest.approx(0.1, rel=0.2)
    for lag, kept in ((1, np.exp(-0.02)), (50, np.exp(-1.0))):
        assert (errors[lag:] * errors[:-lag]).mean() / errors.var() == pytest.approx(kept, abs=0.12)
    white, turned = sensors(40, velocity_noise=0.1), qpos.copy()
    errors = np.stack([white.measure(turned, still, range(40))[1][:, :3] for _ in range(100)])
    assert errors.std() == pytest.approx(0.1, rel=0.05)
    assert abs((errors[1:] * errors[:-1]).mean()) < 0.002


def test_imu_noise_tilts_gravity_but_turns_no_heading():
    qpos, still = home_qpos(yaw=1.0)[None], np.zeros((1, 18))
    faulty = sensors(imu_noise=2.0)
    seen = [faulty.measure(qpos, still, [0]) for _ in range(300)]
    gravity = np.stack([rotate_inverse(np, q[:, 3:7], np.array([[0.0, 0.0, -1.0]]))[0] for q, _ in seen])
    assert 0.08 < np.abs(gravity[:, :2]).max() <= 0.11
    assert max(abs(float(yaw_of(np, q[:, 3:7])[0]) - 1.0) for q, _ in seen) < 0.01
    assert 0.3 < np.abs(np.stack([v[0, 3:6] for _, v in seen])).max() <= 0.4
    np.testing.assert_array_equal(qpos[0], home_qpos(yaw=1.0))


def test_what_a_robot_measures_depends_on_its_own_numbers_alone():
    qpos, qvel = np.stack([home_qpos()] * 3), np.zeros((3, 18))
    together, alone = (
        sensors(3, velocity_bias=0.1, imu_noise=1.0),
        FaultySensors(FaultConfig(velocity_bias=0.1, imu_noise=1.0), [np.random.default_rng(2)]),
    )
    for rows in ([0, 1, 2], [1, 2], [2]):
        many, one = together.measure(qpos, qvel, rows), alone.measure(qpos[2:], qvel[2:], [0])
        np.testing.assert_array_equal(many[1][2], one[1][0])
        np.testing.assert_array_equal(many[0][2], one[0][0])


def test_images_are_late_noisy_and_have_holes():
    faulty = sensors(2, camera_delay=0.04, depth_noise=0.02, depth_holes=0.05)
    for step in range(5):
        faulty.measure(np.full((2, 19), float(step)), np.zeros((2, 18)), [0, 1])
        assert faulty.view_from()[0, 0] == max(step - 2, 0)
    image = torch.full((2, 48, 80), 5.0)
    image[:, 0] = NAVIGATION_CAMERA.far
    seen = faulty.spoil(image, NAVIGATION_CAMERA, [0])
    assert (seen[1] == image[1]).all() and (image[:, 1:] == 5.0).all()
    holes = seen[0, 1:] == NAVIGATION_CAMERA.far
    assert float(holes.float().mean()) == pytest.approx(0.05, abs=0.01)
    assert float(seen[0, 1:][~holes].std()) == pytest.approx(0.1, rel=0.1)
    assert (seen[0, 0] == NAVIGATION_CAMERA.far).all()


def test_body_and_camera_change():
    model, heavy = (build_scene(Boxes.empty(), Boxes.empty()) for _ in range(2))
    FaultConfig(mass_scale=1.2, friction_scale=0.5).change_body(heavy)
    np.testing.assert_allclose(heavy.body_mass, 1.2 * model.body_mass)
    np.testing.assert_allclose(heavy.body_inertia, 1.2 * model.body_inertia)
    assert (heavy.body_invweight0[1:14, 0] < model.body_invweight0[1:14, 0]).all()
    foot = model.geom("FL_foot").id
    assert heavy.geom_friction[foot, 0] == 0.5 * model.geom_friction[foot, 0]
    down = FaultConfig(camera_pitch=2.0).mount(LOCOMOTION_CAMERA).pitch_down
    assert down - LOCOMOTION_CAMERA.pitch_down == pytest.approx(np.radians(2.0))


@pytest.mark.parametrize(
    "faults", [{"action_delay": 0.003}, {"camera_delay": 0.03}, {"kp_scale": 0.0}, {"depth_holes": 1.5}]
)
def test_faults_that_make_no_sense_are_refused(faults: dict):
    with pytest.raises(InputError, match=f"faults.{next(iter(faults))}"):
        FaultConfig(**faults)
