"""The policy that plans its footholds from what it predicts: the same gait as with a map, from its own memory."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import torch

from vinl.gait.config import GaitConfig
from vinl.gait.footholds import plan_footholds
from vinl.gait.ground_view import FieldView, build_ground_map
from vinl.gait.local_map import POINTS
from vinl.gait.observation import GAIT_ROWS, SENSED_TABLE, STEPPING_TABLE
from vinl.gait.path import gait_rows
from vinl.gait.proprioception import feet_in_trunk, heading_axes, into_heading_frame, motion_of
from vinl.gait.state import aim, feet_in_heading_frame, start_gait, tick
from vinl.policies.networks import build_network
from vinl.policies.stepping_actor import Memory, Prediction, SteppingActor
from vinl.robot.aliengo import DEFAULT_POSE, home_qpos
from vinl.robot.cameras import LOCOMOTION_CAMERA
from vinl.robot.rotation import rotate_inverse
from vinl.world.boxes import Boxes
from vinl.world.grid import BLOCK, GridFrame, flat_field, raise_boxes

N = 3
CAMERA = replace(LOCOMOTION_CAMERA, missing="plane")
SMALL = {"hidden": 16, "layers": 1, "actor": [16, 8]}


def poses(rng: np.random.Generator, x: float) -> np.ndarray:
    """Robots that stand a little askew, each at its place."""
    qpos = np.stack([home_qpos(x + 0.1 * k, 0.0, 0.38, rng.uniform(-0.2, 0.2)) for k in range(N)])
    qpos[:, 7:] += rng.uniform(-0.2, 0.2, (N, 12))
    tilt = rng.uniform(-0.05, 0.05, (N, 2))
    qpos[:, 4:6] += tilt
    qpos[:, 3:7] /= np.linalg.norm(qpos[:, 3:7], axis=1, keepdims=True)
    return qpos


def sensed(qpos: np.ndarray, turning: np.ndarray, command: np.ndarray) -> torch.Tensor:
    """What such robots measure, scaled."""
    down = np.broadcast_to([0.0, 0.0, -1.0], (N, 3))
    parts = [turning, rotate_inverse(np, qpos[:, 3:7], down), command, qpos[:, 7:] - DEFAULT_POSE]
    plain = np.concatenate([*parts, np.zeros((N, 24))], 1)
    return torch.from_numpy((plain * SENSED_TABLE.scale).astype(np.float32))


def blind() -> SteppingActor:
    torch.manual_seed(0)
    return SteppingActor(**SMALL).eval()  # type: ignore[arg-type]


def test_feet_and_heading_follow_from_joints_and_gravity() -> None:
    qpos = poses(np.random.default_rng(0), 0.3)
    gravity = rotate_inverse(np, qpos[:, 3:7], np.broadcast_to([0.0, 0.0, -1.0], (N, 3)))
    feet = into_heading_frame(heading_axes(np, gravity), feet_in_trunk(np, qpos[:, 7:]))
    np.testing.assert_allclose(feet, feet_in_heading_frame(np, qpos), atol=1e-6)


def test_told_the_truth_it_walks_as_one_that_has_the_map() -> None:
    rng, network, config = np.random.default_rng(1), blind(), GaitConfig()
    frame = GridFrame(-4.0, -4.0, 0.05, (161, 161))
    field, bar = flat_field(frame), Boxes(np.array([[0.6, 0.0, 0.0, 0.2, 3.0, 0.0, 0.1]]))
    raise_boxes(field, bar, BLOCK)
    ground = build_ground_map(field.heights, frame, bar)
    command = np.tile([0.5, 0.0, 0.1], (N, 1))
    scale = np.concatenate([np.repeat(row.scale, row.size) for row in GAIT_ROWS])
    gait, memory, shifts = None, None, []
    for step in range(40):
        qpos, turning, velocity = poses(rng, 0.01 * step), rng.normal(0, 0.1, (N, 3)), rng.normal(0, 0.2, (N, 3))
        vector = sensed(qpos, turning, command)
        gravity = rotate_inverse(np, qpos[:, 3:7], np.broadcast_to([0.0, 0.0, -1.0], (N, 3)))
        axes, feet = heading_axes(np, gravity), feet_in_heading_frame(np, qpos)
        if memory is None or gait is None:
            gait = start_gait(np, config, feet)
            memory = network.begin(
                network.stance(vector), network.unpack(network.initial_state(N)), torch.ones(N, dtype=torch.bool)
            )
        level = into_heading_frame(axes, velocity)[:, :2]
        gait = tick(np, config, gait, motion_of(np, axes, velocity, turning), command, feet)
        view = FieldView(np, ground, frame, qpos)
        plan = plan_footholds(np, config, view, gait, level, command, feet)
        gait = aim(np, config, gait, plan, level, command, feet)
        shifts.append(np.abs(plan.offset).max())

        said = Prediction(
            torch.from_numpy(velocity).float(),
            torch.from_numpy(view.height(np.broadcast_to(POINTS, (N, *POINTS.shape))) + qpos[:, 2:3]).float(),
        )
        action, new = network.walk(vector, network.stance(vector), said, memory)
        memory = Memory(memory.network, new, said.velocity, None)
        # heights on cells of 5 cm are not the distances that the world's map has
        assert np.median(np.abs(new.target.numpy() - gait.target)[..., :2]) < 0.03
        gait = type(gait)(*(x.numpy().astype(float) for x in new))
        rows = gait_rows(np, config, gait, feet) * scale
        full = torch.cat([said.velocity * 2.0, vector, torch.from_numpy(rows).float()], 1)
        torch.testing.assert_close(action, network.actor(full), atol=1e-3, rtol=1e-3)
    assert max(shifts) > 0.1  # the bar was in the way


def test_slow_commands_are_raised_before_a_block_but_not_in_training() -> None:
    network, still, heights = blind(), torch.zeros(N, 3), torch.zeros(N, len(POINTS))
    heights[0, (POINTS[:, 0] > 0.4) & (POINTS[:, 0] < 0.65)] = 0.1

    def act(forward: float, adapt: bool) -> torch.Tensor:
        vector = sensed(poses(np.random.default_rng(4), 0.0), np.zeros((N, 3)), np.tile([forward, 0.0, 0.1], (N, 1)))
        stance, state = network.stance(vector), network.unpack(network.initial_state(N))
        memory = network.begin(stance, state, torch.ones(N, dtype=torch.bool))
        return network.walk(vector, stance, Prediction(still, heights), memory, adapt)[0]

    slow, fast, adapted = act(0.3, False), act(0.5, False), act(0.3, True)
    torch.testing.assert_close(adapted[0], fast[0])
    torch.testing.assert_close(adapted[1:], slow[1:])
    assert not torch.allclose(slow[0], fast[0])


def test_steps_in_a_row_are_the_same_as_one_by_one_and_fresh_robots_forget() -> None:
    network, rng = blind(), np.random.default_rng(2)
    command = np.tile([0.4, 0.0, 0.0], (N, 1))
    vectors = torch.stack([sensed(poses(rng, 0.0), np.zeros((N, 3)), command) for _ in range(6)])
    fresh = torch.zeros(6, N, dtype=torch.bool)
    fresh[0] = True
    fresh[3, 1] = True
    together, last = network(None, vectors, network.initial_state(N), fresh)
    state, apart = network.initial_state(N), []
    for k in range(6):
        action, state = network(None, vectors[k : k + 1], state, fresh[k : k + 1])
        apart.append(action)
    torch.testing.assert_close(together, torch.cat(apart))
    for a, b in zip(last, state, strict=True):
        torch.testing.assert_close(a, b)
    begun, _ = network(None, vectors[3:4], network.initial_state(N), torch.ones(1, N, dtype=torch.bool))
    torch.testing.assert_close(together[3, 1], begun[0, 1])
    assert not torch.allclose(together[3, 0], begun[0, 0])


def test_the_map_does_not_depend_on_which_feet_stand_by_the_clock() -> None:
    network = SteppingActor(**SMALL, camera=CAMERA.describe()).eval()  # type: ignore[arg-type]
    vector = sensed(poses(np.random.default_rng(3), 0.0), np.zeros((N, 3)), np.zeros((N, 3)))
    stance = network.stance(vector)
    memory = network.begin(stance, network.unpack(network.initial_state(N)), torch.ones(N, dtype=torch.bool))
    image, still = torch.full((N, CAMERA.height, CAMERA.width), 0.3), torch.zeros(N, 3)
    swinging = memory._replace(gait=memory.gait._replace(phases=torch.full((N, 4), 0.1)))
    seen = [network.survey(image, stance, still, then)[0] for then in (memory, swinging)]
    assert seen[0].abs().max() > 0.05  # there is something on it
    torch.testing.assert_close(seen[0], seen[1])


def test_a_card_rebuilds_it_with_its_gait() -> None:
    network = SteppingActor(**SMALL, camera=CAMERA.describe(), gait={"stride": 0.5, "period": [0.5, 1.0]})  # type: ignore[arg-type]
    with torch.device("meta"):
        again = build_network(network.describe())
    assert isinstance(again, SteppingActor)
    assert again.gait == network.gait and again.observation_size == SENSED_TABLE.size
    assert again.elevation is not None and again.elevation.rays.device.type == "cpu"
    assert STEPPING_TABLE.size == SENSED_TABLE.size + 3 + sum(row.size for row in GAIT_ROWS)


def test_feet_that_stand_and_agree_correct_the_velocity() -> None:
    network = blind()
    vector = sensed(poses(np.random.default_rng(7), 0.0), np.zeros((N, 3)), np.zeros((N, 3)))
    stance = network.stance(vector)
    memory = network.begin(stance, network.unpack(network.initial_state(N)), torch.ones(N, dtype=torch.bool))
    assert stance.by_feet.abs().max() < 1e-4  # nothing moves

    def believe(forward: float) -> torch.Tensor:
        said = torch.tensor([[forward, 0.0, 0.2]]).expand(N, 3)
        return network.believe(said, stance, memory)

    near, far = believe(0.05), believe(1.0)
    assert (near[:, 0].abs() < 0.02).all()
    torch.testing.assert_close(far[:, :2], torch.tensor([[1.0, 0.0]]).expand(N, 2))  # all feet slip
    torch.testing.assert_close(near[:, 2], torch.full((N,), 0.2))
    phases = torch.full_like(memory.gait.phases, 0.1)  # all feet in the air
    swinging = memory._replace(gait=memory.gait._replace(phases=phases))
    torch.testing.assert_close(network.believe(far, stance, swinging), far)
