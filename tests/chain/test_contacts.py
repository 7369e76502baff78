"""Contacts of a robot that is put on hand-made scenes."""

import mujoco
import numpy as np
import pytest

from vinl.chain.robot import KINDS, ContactReader, Robot
from vinl.chain.scene import build_scene
from vinl.robot.aliengo import DEFAULT_POSE
from vinl.world.boxes import Boxes
from vinl.world.grid import GridFrame, flat_field

NONE = Boxes.empty()


def touched(walls: Boxes, blocks: Boxes, steps: int = 25) -> tuple[set[str], bool, ContactReader]:
    """Let the robot stand for a while: what it touched, whether the paper's rule was broken."""
    robot = Robot(build_scene(walls, blocks))
    robot.spawn(0.0, 0.0, 0.0, DEFAULT_POSE)
    kinds, rule = set(), False
    for _ in range(steps):
        robot.step(DEFAULT_POSE)
        kinds |= {KINDS[k] for k in robot.contacts.touches}
        rule |= robot.contacts.breaks_paper_rule()
    return kinds, rule, robot.contacts


def feet() -> np.ndarray:
    """Where the four feet stand [m]."""
    robot = Robot(build_scene(NONE, NONE))
    robot.spawn(0.0, 0.0, 0.0, DEFAULT_POSE)
    return np.array([robot.data.geom(f"{leg}_foot").xpos for leg in ("FL", "FR", "RL", "RR")])


def box(x: float, y: float, length: float, width: float, bottom: float, top: float) -> Boxes:
    return Boxes(np.array([[x, y, 0.0, length, width, bottom, top]]))


def test_level_floor_is_no_obstacle() -> None:
    assert touched(NONE, NONE)[:2] == (set(), False)


@pytest.mark.parametrize("what", ["block", "wall"])
def test_foot_on_a_box_counts_by_what_the_box_is(what: str) -> None:
    x, y, _ = feet()[0]
    under = box(x, y, 0.12, 0.12, 0.0, 0.04)
    kinds, rule, _ = touched(NONE, under) if what == "block" else touched(under, NONE)
    assert kinds == {f"foot_{what}"}
    assert rule  # the foot's middle is 0.04 + 0.0265 m high


def test_touch_knows_where() -> None:
    x, y, _ = feet()[3]
    _, _, reader = touched(NONE, box(x, y, 0.12, 0.12, 0.0, 0.04))
    touch = reader.touches[KINDS.index("foot_block")]
    assert np.hypot(touch.x - x, touch.y - y) < 0.08
    assert touch.z == pytest.approx(0.04, abs=0.02)


def test_shank_against_a_block_is_a_leg_contact() -> None:
    x, y, _ = feet()[0]
    kinds, _, _ = touched(NONE, box(x - 0.12, y, 0.06, 0.2, 0.1, 0.16))
    assert "leg_block" in kinds
    assert not any(kind.startswith("foot") for kind in kinds)


def test_trunk_between_walls() -> None:
    kinds, _, _ = touched(box(0.36, 0.0, 0.06, 0.05, 0.3, 0.5), NONE)
    assert kinds == {"trunk_wall"}


def test_low_box_escapes_the_paper_rule_only() -> None:
    x, y, _ = feet()[0]
    kinds, rule, _ = touched(NONE, box(x, y, 0.12, 0.12, 0.0, 0.01))
    assert kinds == {"foot_block"}
    assert not rule


def test_force_sensors_carry_the_weight() -> None:
    robot = Robot(build_scene(NONE, NONE))
    robot.spawn(0.0, 0.0, 0.0, DEFAULT_POSE)
    for _ in range(100):
        robot.step(DEFAULT_POSE)
    weight = float(mujoco.mj_getTotalmass(robot.model)) * 9.81
    assert abs(robot.contacts._forces[:, 2].sum()) == pytest.approx(weight, rel=0.05)


def test_lying_robot_has_fallen() -> None:
    robot = Robot(build_scene(NONE, NONE))
    robot.spawn(0.0, 0.0, 0.0, DEFAULT_POSE, ground=-0.35)
    robot.step(DEFAULT_POSE)
    assert robot.has_fallen(1.2566)


def test_standing_on_a_height_field_is_like_standing_on_a_plane() -> None:
    field = flat_field(GridFrame(-1.0, -1.0, 0.05, (41, 41)))
    heights = []
    for ground in (None, field):
        robot = Robot(build_scene(NONE, NONE, ground))
        robot.spawn(0.0, 0.0, 0.3, DEFAULT_POSE)
        for _ in range(100):
            robot.step(DEFAULT_POSE)
        assert not robot.has_fallen(1.2566)
        heights.append(robot.qpos[2])
    assert heights[0] == pytest.approx(heights[1], abs=0.01)
