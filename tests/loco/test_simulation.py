"""The simulated robot: late targets, torque that fades with speed, legs that cannot pass through each other."""

import jax.numpy as jnp
import mujoco
import numpy as np
import pytest

from vinl.loco.simulation import LEG_PAIRS, PAST, delay_steps, target_age, torque_range
from vinl.robot.aliengo import JOINT_SPEED_LIMIT, TORQUE_LIMIT, home_qpos
from vinl.robot.model import robot_spec


@pytest.mark.parametrize(
    ("latency", "ages"), [(0.0, [0] * 4), (0.01, [1, 1, 0, 0]), (0.03, [2, 2, 1, 1]), (0.04, [2] * 4)]
)
def test_a_target_takes_effect_within_the_control_step(latency, ages):
    delay = delay_steps(jnp.array([latency]))[0]
    assert [int(target_age(jnp.asarray(k), delay)) for k in range(4)] == ages and max(ages) < PAST


def test_torque_fades_towards_the_largest_speed_and_brakes_do_not():
    still, fast = torque_range(np, np.zeros(12)), torque_range(np, JOINT_SPEED_LIMIT)
    assert (still[:, 1] == TORQUE_LIMIT).all() and (still[:, 0] == -TORQUE_LIMIT).all()
    assert (fast[:, 1] == 0).all() and (fast[:, 0] == -TORQUE_LIMIT).all()
    assert torque_range(np, -0.85 * JOINT_SPEED_LIMIT)[:, 0] == pytest.approx(-0.5 * TORQUE_LIMIT)
    assert (torque_range(np, -2 * JOINT_SPEED_LIMIT)[:, 1] == TORQUE_LIMIT).all()


def test_pairs_of_spheres_meet_where_legs_do():
    spec = robot_spec("spheres")
    for a, b in LEG_PAIRS:
        spec.add_pair(geomname1=a, geomname2=b, condim=1)
    model = spec.compile()
    data = mujoco.MjData(model)
    data.qpos[:] = home_qpos()
    mujoco.mj_forward(model, data)
    assert data.ncon == 0
    pose = home_qpos()
    pose[7:10], pose[13:16] = [0.0, 1.55, -1.5], [0.0, -0.1, -1.5]  # the left front foot back, the rear one ahead
    data.qpos[:] = pose
    mujoco.mj_forward(model, data)
    touching = {model.geom(g).name for contact in data.contact for g in contact.geom}
    assert data.ncon >= 1 and all(name.startswith(("FL", "RL")) for name in touching)
