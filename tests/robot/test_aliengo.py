"""The robot against the numbers it was made from, and whether it stands."""

import mujoco
import numpy as np
import pytest

from vinl.robot.aliengo import (
    ACTION_SCALE,
    CONTROL_DT,
    DEFAULT_POSE,
    FOOT_GEOMS,
    FOOT_RADIUS,
    JOINTS,
    LEGS,
    MASS,
    SHANK_SPHERES,
    TRUNK_SPHERES,
    home_qpos,
)
from vinl.robot.model import robot_spec

COLLISION = ("spheres", "primitives")


def standing_model(collision: str, **changes) -> mujoco.MjModel:
    spec = robot_spec(collision)
    spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, size=[0, 0, 1], contype=1, conaffinity=0)
    model = spec.compile()
    for name, value in changes.items():
        setattr(model.opt, name, value)
    return model


def stand(model: mujoco.MjModel, seconds: float) -> tuple[mujoco.MjData, float]:
    """Holds the default pose; returns the end and the lowest z of the trunk's up axis on the way."""
    data = mujoco.MjData(model)
    data.qpos[:] = home_qpos()
    data.ctrl[:] = DEFAULT_POSE
    upright = 1.0
    for _ in range(round(seconds / model.opt.timestep)):
        mujoco.mj_step(model, data)
        upright = min(upright, float(data.xmat[1, 8]))
    return data, upright


@pytest.fixture(scope="module", params=COLLISION)
def model(request) -> mujoco.MjModel:
    return robot_spec(request.param).compile()


def test_weighs_what_the_maker_says(model):
    assert model.body_mass.sum() == pytest.approx(24.937, abs=1e-6) == MASS
    per_body = {model.body(k).name: model.body_mass[k] for k in range(1, model.nbody)}
    assert per_body["trunk"] == pytest.approx(12.229)
    for leg in LEGS:
        assert [per_body[f"{leg}_{part}"] for part in ("hip", "thigh", "calf")] == pytest.approx([2.139, 0.771, 0.267])


def test_is_as_heavy_on_the_left_as_on_the_right(model):
    for part in ("hip", "thigh", "calf"):
        for left, right in (("FL", "FR"), ("RL", "RR")):
            a, b = model.body(f"{left}_{part}"), model.body(f"{right}_{part}")
            assert np.allclose(a.ipos, b.ipos * [1, -1, 1], atol=1.1e-4)
            assert np.allclose(sorted(a.inertia), sorted(b.inertia), rtol=1e-6)


def test_joints_are_in_order_and_have_their_limits(model):
    """Angles in radians: without limits on the thighs, or with limits read as degrees, it cannot stand."""
    assert tuple(model.joint(k).name for k in range(1, model.njnt)) == JOINTS
    assert tuple(model.actuator(k).name for k in range(model.nu)) == JOINTS
    assert model.jnt_limited[1:].all()
    limits = np.array([[-1.22173, 1.22173], [-1.0472, 4.18879], [-2.77507, -0.64577]] * 4)
    assert np.allclose(model.jnt_range[1:], limits, atol=1e-5)
    assert (limits[:, 0] < DEFAULT_POSE).all() and (limits[:, 1] > DEFAULT_POSE).all()


def test_legs_have_their_lengths(model):
    for leg, (x, y) in zip(LEGS, ((1, 1), (1, -1), (-1, 1), (-1, -1)), strict=True):
        assert np.allclose(model.body(f"{leg}_hip").pos, [0.2407 * x, 0.051 * y, 0])
        assert np.allclose(model.body(f"{leg}_thigh").pos, [0, 0.0868 * y, 0])
        assert np.allclose(model.body(f"{leg}_calf").pos, [0, 0, -0.25])
        assert np.allclose(model.geom(f"{leg}_foot").pos, [0, 0, -0.25])
        assert model.geom(f"{leg}_foot").size[0] == FOOT_RADIUS == 0.0265


def test_motors(model):
    assert np.allclose(model.actuator_forcerange, np.array([[-1, 1]]) * np.array([[35.278], [35.278], [44.4]] * 4))
    assert np.allclose(model.actuator_gainprm[:, 0], 40.0)
    assert np.allclose(model.actuator_biasprm[:, :3], [0.0, -40.0, -2.0])
    assert np.allclose(model.dof_armature[6:], [0.0094, 0.0152, 0.023] * 4)
    assert np.allclose(model.dof_frictionloss[6:], [0.48, 0.298, 0.37] * 4)
    assert np.allclose(model.dof_damping[6:], [0.178, 0.201, 0.266] * 4)


def test_other_gains_are_options():
    model = robot_spec("spheres", kp=60.0, kd=3.0).compile()
    assert np.allclose(model.actuator_gainprm[:, 0], 60.0)
    assert np.allclose(model.actuator_biasprm[:, 1:3], [-60.0, -3.0])


def test_control_rate_and_pose():
    assert pytest.approx(0.02) == CONTROL_DT and ACTION_SCALE == 0.25
    expected = [0.1, 0.8, -1.5, -0.1, 0.8, -1.5, 0.1, 1.0, -1.5, -0.1, 1.0, -1.5]
    assert DEFAULT_POSE.tolist() == expected


def test_each_collision_set_has_its_shapes():
    names = {c: {g.name for g in robot_spec(c).geoms} for c in COLLISION}
    assert names["spheres"] == {*FOOT_GEOMS, *SHANK_SPHERES, *TRUNK_SPHERES}
    assert names["primitives"] == {*FOOT_GEOMS, "trunk"} | {
        f"{leg}_{p}" for leg in LEGS for p in ("hip", "thigh", "shank")
    }
    spheres = robot_spec("spheres").compile()
    assert (spheres.geom_type == mujoco.mjtGeom.mjGEOM_SPHERE).all()


def touching_bodies(model: mujoco.MjModel, joints: np.ndarray) -> set[frozenset[str]]:
    data = mujoco.MjData(model)
    data.qpos[:] = home_qpos()
    data.qpos[7:] = joints
    mujoco.mj_forward(model, data)
    return {frozenset(model.body(model.geom_bodyid[g]).name for g in pair) for pair in data.contact.geom}


def test_legs_touch_each_other_and_neighbouring_links_never_do():
    model = robot_spec("primitives").compile()
    low, high = model.jnt_range[1:].T
    assert touching_bodies(model, DEFAULT_POSE) == set()
    crossed = DEFAULT_POSE.copy()
    crossed[[0, 3]] = -0.5, 0.5  # both front legs swing inwards
    assert frozenset({"FL_calf", "FR_calf"}) in touching_bodies(model, crossed)
    rng = np.random.default_rng(0)
    met = set().union(*(touching_bodies(model, rng.uniform(low, high)) for _ in range(1000)))
    joined = {frozenset({model.body(k).name, model.body(model.body_parentid[k]).name}) for k in range(2, model.nbody)}
    assert len(met) > 10 and not met & joined and all(len(pair) == 2 for pair in met)


def test_spheres_touch_the_world_alone():
    model = robot_spec("spheres").compile()
    assert not (model.geom_contype[:, None] & model.geom_conaffinity[None]).any()
    assert (model.geom_conaffinity == 1).all()


def test_visual_meshes_only_on_request():
    seen = robot_spec("primitives", visual=True).compile()
    assert seen.nmesh == 6
    visual = seen.geom_type == mujoco.mjtGeom.mjGEOM_MESH
    assert visual.sum() == 2 + 4 * 4
    assert (seen.geom_contype[visual] == 0).all() and (seen.geom_conaffinity[visual] == 0).all()
    assert seen.body_mass.sum() == pytest.approx(24.937, abs=1e-6)
    assert robot_spec("primitives").compile().nmesh == 0


@pytest.mark.parametrize("collision", COLLISION)
def test_stands_for_five_seconds(collision):
    model = standing_model(collision)
    data, upright = stand(model, 5.0)
    assert np.isfinite(data.qpos).all()
    # With kp 40 it sags from 0.38 m to about 0.30-0.32 m.
    assert 0.27 < data.qpos[2] < 0.36
    assert upright > np.cos(np.radians(8))
    assert np.abs(data.qpos[:2]).max() < 0.1  # it leans back as it sags
    touching = {model.geom(g).name for pair in data.contact.geom for g in pair} - {""}
    assert touching == set(FOOT_GEOMS)
    limit = model.actuator_forcerange[:, 1]
    assert (np.abs(data.actuator_force) < 0.5 * limit).all()


def test_stands_on_few_iterations_only_without_eulerdamp():
    """What makes MJX fast: one Newton iteration. It holds with eulerdamp off, and blows up with it on."""
    spheres = robot_spec("spheres").option
    assert (spheres.iterations, spheres.ls_iterations, spheres.timestep) == (1, 5, 0.005)
    assert spheres.integrator == mujoco.mjtIntegrator.mjINT_EULER
    assert spheres.disableflags & mujoco.mjtDisableBit.mjDSBL_EULERDAMP
    quiet, _ = stand(standing_model("spheres"), 2.0)
    wild, _ = stand(standing_model("spheres", disableflags=0), 2.0)
    assert np.abs(quiet.qvel).max() < 0.2
    assert np.abs(wild.qvel).max() > 2.0


def test_falls_when_the_motors_are_off():
    model = standing_model("primitives")
    model.actuator_gainprm[:] = 0
    model.actuator_biasprm[:] = 0
    data, _ = stand(model, 2.0)
    assert data.qpos[2] < 0.2
