"""A live session without a browser: it walks, obeys, and changes its world under the robot."""

from dataclasses import asdict

import numpy as np
import pytest
import torch

import vinl
from vinl.config.errors import InputError
from vinl.config.loader import load_config
from vinl.gait.config import GaitConfig
from vinl.gait.observation import SENSED_TABLE
from vinl.policies.card import locomotion_card
from vinl.policies.depth_policy import DepthPolicy
from vinl.policies.networks import PolicyNetwork, StepActor
from vinl.policies.policy import LocomotionPolicy, Policy
from vinl.policies.stepping_actor import SteppingActor
from vinl.viewer.live import LiveChain
from vinl.viewer.session import (
    ChangePolicies,
    Drive,
    OpenPlan,
    PlaceRobot,
    Push,
    Reset,
    ScatterClutter,
    Seek,
    Session,
    SetGoal,
    Snapshot,
    StepOnce,
    ToggleBlock,
)
from vinl.viewer.world import TOO_CLOSE, open_ground, open_home

CONFIG = vinl.EvaluationConfig()
PLAN = vinl.load_floorplan("harbour_flat")


@pytest.fixture(scope="module")
def rough() -> Policy:
    return vinl.load_policy("rough")


@pytest.fixture
def session(rough: Policy) -> Session:
    return Session(LiveChain(open_home(PLAN, "none", 0, CONFIG), rough, "oracle", CONFIG))


@pytest.fixture
def ground(rough: Policy) -> Session:
    return Session(LiveChain(open_ground("flat", 0), rough, "oracle", CONFIG))


def test_robot_stands_until_it_is_given_a_goal_and_stops_there(ground: Session):
    still = ground.advance(50)
    assert still.state == "standing" and np.linalg.norm(still.qpos[:2]) < 0.1 and not still.command.any()
    ground.ask(SetGoal(1.5, 0.5))
    walking = ground.advance(50)
    assert walking.state == "walking" and walking.command[0] > 0.2 and "m to walk" in walking.notice[1]
    there = ground.advance(250)
    assert there.state == "reached" and there.goal is None and not there.command.any()
    assert np.linalg.norm(there.qpos[:2] - [1.5, 0.5]) < 0.6
    assert there.distance_m > 1.1 and len(there.path) > 40


def test_command_is_followed_until_another_one(ground: Session):
    ground.ask(Drive(0.5, 0.0))
    ahead = ground.advance(100)
    assert ahead.state == "driven" and 0.5 < ahead.qpos[0] < 1.3 and 0.2 < ahead.velocity[0] < 0.8
    ground.ask(Drive(0.0, 0.8))
    turned = ground.advance(100)
    yaw = 2 * np.arctan2(turned.qpos[6], turned.qpos[3])
    assert 0.8 < yaw < 2.4
    ground.ask(Drive(0.0, 0.0))
    assert ground.advance(1).state == "standing"


def test_push_changes_the_velocity_at_once(ground: Session):
    ground.advance(25)
    ground.ask(Push(0.6, np.pi / 2))
    pushed = ground.advance(1)
    assert pushed.velocity[1] > 0.3


def test_reset_puts_the_robot_back_to_where_it_was_put_down(ground: Session):
    ground.ask(PlaceRobot(2.0, -1.0))
    placed = ground.advance(0)
    np.testing.assert_allclose(placed.qpos[:2], [2.0, -1.0])
    ground.ask(Drive(0.6, 0.0))
    assert ground.advance(100).qpos[0] > 2.4
    ground.ask(Reset())
    back = ground.advance(0)
    np.testing.assert_allclose(back.qpos[:2], [2.0, -1.0])
    assert back.time_s == 0 and back.distance_m == 0 and back.state == "standing"


def test_session_repeats_itself(rough: Policy):
    def walk() -> np.ndarray:
        session = Session(LiveChain(open_home(PLAN, "paper", 3, CONFIG), rough, "oracle", CONFIG, seed=3))
        session.ask(ScatterClutter("dense"))
        session.ask(Drive(0.4, 0.2))
        return session.advance(30).qpos

    np.testing.assert_array_equal(walk(), walk())


def test_block_is_put_down_seen_and_taken_away_while_the_robot_walks(ground: Session):
    ground.ask(Drive(0.4, 0.0))
    before = ground.advance(40)
    x = before.qpos[0] + 1.0
    ground.ask(ToggleBlock(x, 0.0))
    after = ground.advance(0)
    assert len(after.world.blocks) == 1 and after.world is not before.world
    np.testing.assert_array_equal(after.qpos, before.qpos)  # its motion goes on
    nearer = after.images["locomotion"].depth < before.images["locomotion"].depth - 0.05
    assert nearer.sum() > 20
    ground.ask(ToggleBlock(x, 0.0))
    gone = ground.advance(1)
    assert len(gone.world.blocks) == 0
    ground.ask(ToggleBlock(gone.qpos[0] + TOO_CLOSE / 2, gone.qpos[1]))
    refused = ground.advance(1)
    assert len(refused.world.blocks) == 0 and "the robot is in the way" in refused.notice[1]


def test_contacts_are_shown_where_they_happen(ground: Session):
    """A blind walk into a block: something touches it, near it."""
    ground.ask(ToggleBlock(0.9, 0.0))
    ground.ask(Drive(0.5, 0.0))
    last = ground.advance(150)
    assert sum(last.contact_steps) > 0 and len(last.contacts) > 0
    away = last.world.blocks.boxes().distances(last.contacts[:, 2:4])
    assert away.max() < 0.05
    assert last.foot_forces.max() > 30


def test_clutter_is_drawn_anew_and_cleared(session: Session):
    session.ask(ScatterClutter("paper"))
    first = session.advance(0).world.blocks
    session.ask(ScatterClutter("paper"))
    second = session.advance(0).world.blocks
    assert len(first) > 20 and len(second) > 20 and not np.array_equal(first.rows, second.rows)
    session.ask(ScatterClutter("none"))
    cleared = session.advance(0)
    assert len(cleared.world.blocks) == 0 and cleared.notice[1] == "0 blocks"


def test_goal_where_the_robot_does_not_fit_is_refused_or_moved(session: Session):
    session.ask(SetGoal(-50.0, 0.0))
    assert "does not fit" in session.advance(0).notice[1] and session.snapshot.goal is None
    wall = PLAN.walls.rows[0]
    session.ask(SetGoal(wall[0], wall[1]))
    goal = session.advance(0).goal
    assert goal is not None and 0.1 < np.linalg.norm(goal - wall[:2]) <= 0.5


def test_fallen_robot_stops_time_until_reset(ground: Session):
    ground.ask(Push(12.0, np.pi / 2))
    fallen = ground.advance(200)
    assert fallen.state == "fallen" and fallen.paused
    ground.ask(SetGoal(1.0, 0.0))
    assert "fallen" in ground.advance(1).notice[1]
    ground.ask(Reset())
    assert ground.advance(10).state == "standing"


def test_policies_and_plan_are_changed(session: Session):
    session.advance(5)
    session.ask(ChangePolicies(navigation="nav"))
    x, y = session.snapshot.qpos[:2]
    session.ask(SetGoal(x + 1.0, y))
    assert session.advance(2).command.any()
    seen = session.snapshot.images["navigation"]
    assert seen.depth.shape == (seen.camera.height, seen.camera.width) == (60, 80)
    session.ask(ChangePolicies(locomotion="nav"))
    assert "locomotion policy" in session.advance(1).notice[1]
    session.ask(OpenPlan("mill_loft"))
    moved = session.advance(2)
    assert moved.world.plan.name == "mill_loft" and moved.goal is None and moved.state == "standing"


def test_request_for_a_recording_is_answered(session: Session):
    session.ask(Seek(1.0))
    assert "for recordings" in session.advance(0).notice[1]


def test_one_step_is_one_control_step(ground: Session):
    ground.advance(3)
    ground.ask(StepOnce())
    once = ground.advance(10)
    assert once.paused and once.time_s == pytest.approx(0.08)


def test_footholds_are_shown_where_a_policy_tells_them(rough: Policy):
    class Telling:
        """The same policy, which also tells where its feet are to come down."""

        def __init__(self) -> None:
            self.card, self.camera, self.reset, self.act = rough.card, rough.camera, rough.reset, rough.act

        def footholds(self) -> dict[str, np.ndarray]:
            ahead = np.array([[[0.3, 0.15, -0.4], [0.3, -0.15, -0.4], [-0.2, 0.15, -0.4], [-0.2, -0.15, -0.4]]])
            return {"planned": ahead, "predicted": ahead + 0.01}

    world = open_home(PLAN, "none", 0, CONFIG)
    session = Session(LiveChain(world, Telling(), "oracle", CONFIG))
    snapshot = session.advance(2)
    assert snapshot.footholds.planned is not None and snapshot.footholds.predicted is not None
    yaw = 2 * np.arctan2(snapshot.qpos[6], snapshot.qpos[3])
    heading, left = np.array([np.cos(yaw), np.sin(yaw)]), np.array([-np.sin(yaw), np.cos(yaw)])
    expected = snapshot.qpos[:2] + 0.3 * heading + 0.15 * left
    np.testing.assert_allclose(snapshot.footholds.planned[0, :2], expected, atol=2e-3)
    plain = Session(LiveChain(world, rough, "oracle", CONFIG)).snapshot
    assert plain.footholds.planned is None and plain.footholds.predicted is None


def with_gait() -> Policy:
    """Observes the rows of a gait; random weights, it stands nearly still."""
    torch.manual_seed(0)
    network: PolicyNetwork = StepActor(actor=[16])
    return LocomotionPolicy(network, locomotion_card("steps", network.describe(), gait=asdict(GaitConfig())))


def test_planned_footholds_are_those_of_the_gait_and_outlast_a_block():
    def walk(blocks: list[ToggleBlock]) -> tuple[Snapshot, Snapshot]:
        session = Session(LiveChain(open_ground("flat", 0), with_gait(), "oracle", CONFIG))
        session.ask(Drive(0.5, 0.0))
        before = session.advance(20)
        for block in blocks:
            session.ask(block)
        return before, session.advance(10)

    before, after = walk([])
    assert before.footholds.planned is not None and after.footholds.planned is not None
    assert np.abs(before.footholds.planned[:, 2] - before.feet[:, 2]).max() < 0.03  # on level ground, as the feet
    ahead = before.footholds.planned[:, 0] - before.feet[:, 0]
    assert 0.0 < ahead.mean() < 0.4
    _, other = walk([ToggleBlock(3.0, 3.0)])
    assert other.footholds.planned is not None
    np.testing.assert_allclose(other.footholds.planned, after.footholds.planned, atol=2e-3)  # the clock went on


def test_footholds_of_a_policy_that_predicts_them():
    network = SteppingActor(hidden=8, layers=1, actor=[8])
    policy = DepthPolicy(network, locomotion_card("student", network.describe(), table=SENSED_TABLE))
    session = Session(LiveChain(open_ground("flat", 0), policy, "oracle", CONFIG))
    assert session.snapshot.footholds.predicted is None
    seen = session.advance(5)
    assert seen.footholds.planned is None and seen.footholds.predicted is not None
    assert np.linalg.norm(seen.footholds.predicted - seen.feet, axis=1).max() < 0.15  # it has no command: as it stands


def test_what_the_navigation_policy_remembers_stands_in_the_home(rough: Policy):
    session = Session(LiveChain(open_home(PLAN, "none", 0, CONFIG), rough, "nav", CONFIG))
    x, y = session.snapshot.qpos[:2]
    assert not len(session.snapshot.occupied)
    session.ask(SetGoal(x + 1.0, y))
    seen = session.advance(60)
    assert len(seen.occupied) > 20
    assert (PLAN.boxes.distances(seen.occupied).min(0) < 0.15).mean() > 0.85  # but for edges far away
    session.ask(Reset())
    assert not len(session.advance(0).occupied)
    session.ask(ChangePolicies(None, "oracle"))
    session.ask(SetGoal(x + 1.0, y))
    assert not len(session.advance(30).occupied)


def test_errors_of_sensors_and_faults_are_those_of_the_evaluation(rough: Policy):
    def walk(*settings: str) -> Snapshot:
        rules = load_config(vinl.EvaluationConfig, "eval/default", settings)
        session = Session(LiveChain(open_home(PLAN, "none", 0, rules), rough, "nav", rules))
        x, y = session.snapshot.qpos[:2]
        session.ask(SetGoal(x + 1.0, y))
        session.advance(30)
        session.ask(ToggleBlock(x - 1.0, y))  # late motors and cameras outlive a change of the world
        return session.advance(5)

    ideal, faulty = walk(), walk("faults.action_delay=0.02", "faults.velocity_noise=0.1", "faults.kp_scale=0.8")
    assert np.linalg.norm(ideal.qpos - faulty.qpos) > 1e-3
    np.testing.assert_array_equal(faulty.images["navigation"].depth > 0, True)
    seen = walk("sensors=sensors/realistic", "odometry.drift=[0.02,0.02]")
    assert (seen.images["navigation"].depth == 0).mean() > 0.005  # pixels without a return
    np.testing.assert_array_equal(seen.qpos, walk("sensors=sensors/realistic", "odometry.drift=[0.02,0.02]").qpos)


def test_open_ground_keeps_the_start_clear():
    world = open_ground("blocks", 0)
    assert len(world.blocks) > 300
    assert world.blocks.boxes().distances(world.start[None, :2]).min() >= TOO_CLOSE
    with pytest.raises(InputError, match="did you mean 'blocks'"):
        open_ground("block", 0)
