import math

import numpy as np
import pytest

from vinl.render.raytrace import ChaseCamera, RayRenderer, look_at
from vinl.render.scene import BLOCK, GOAL, RobotShape, plain_scene, plan_scene
from vinl.robot.aliengo import home_qpos
from vinl.world.boxes import Blocks, Boxes
from vinl.world.floorplan import FloorPlan
from vinl.world.grid import GridFrame

FRAME = GridFrame(-10.0, -10.0, 1.0, (21, 21))
WALL_BEHIND = Boxes(np.array([[-0.8, 0.0, 0.0, 0.1, 6.0, 0.0, 1.2]]))


@pytest.fixture(scope="module")
def shape() -> RobotShape:
    return RobotShape()


def test_views_are_right_handed_and_level():
    view = look_at((1.0, 2.0, 3.0), (0.0, 0.0, 0.0))
    assert np.allclose(view.rotation.T @ view.rotation, np.eye(3))
    assert np.linalg.det(view.rotation) == pytest.approx(1.0)
    assert view.rotation[2, 1] == 0.0 and view.rotation[2, 2] > 0
    assert np.allclose(look_at((0, 0, 3), (0, 0, 0)).rotation[:, 0], [0, 0, -1])


def test_sky_floor_and_box_are_where_they_belong():
    scene = plain_scene(Boxes(np.array([[3.0, 1.0, 0, 0.5, 0.5, 0, 1.0]])), [(1.0, 0.1, 0.1)], FRAME)
    picture = RayRenderer(scene).render(look_at((0, 0, 0.5), (1, 0, 0.5)), 80, 60)
    assert picture.shape == (60, 80, 3) and picture.dtype == np.uint8
    sky, floor = picture[0, 40].astype(int), picture[-1, 40].astype(int)
    assert sky[2] > sky[0] and floor[0] > floor[2]
    # One metre to the left is left in the picture.
    red = (picture[..., 0] > 2.0 * picture[..., 1]).nonzero()
    assert len(red[0]) > 20 and red[1].max() < 40


def test_robot_is_drawn_where_it_stands_and_throws_a_shadow(shape):
    scene = plain_scene(Boxes.empty(), [], FRAME)
    renderer = RayRenderer(scene, shape.bodies, shape.names)
    view = look_at((0.0, 0.0, 3.0), (0.001, 0.0, 0.0))
    empty = renderer.render(view, 96, 96)
    shown = renderer.render(view, 96, 96, *shape.place(home_qpos()), shadows=0)
    shaded = renderer.render(view, 96, 96, *shape.place(home_qpos()), shadows=1)
    changed = (shown != empty).any(-1)
    rows, columns = changed.nonzero()
    # Seen from above at 60 deg over 96 pixels: 0.0361 m a pixel at the floor, a little less at the trunk.
    assert 0.15 < changed.sum() * 0.0361**2 < 0.3  # square metres
    assert np.ptp(rows) * 0.033 == pytest.approx(0.70, abs=0.12)
    assert np.ptp(columns) * 0.034 == pytest.approx(0.34, abs=0.1)
    darker = shaded.astype(int).sum(-1) < shown.astype(int).sum(-1) - 30
    assert (darker & ~changed).sum() > 20


def test_frames_must_fit(shape):
    renderer = RayRenderer(plain_scene(Boxes.empty(), [], FRAME), shape.bodies, shape.names)
    with pytest.raises(ValueError, match="13 bodies"):
        renderer.render(look_at((0, 0, 3), (1, 0, 0)), 8, 8, np.zeros((2, 3)), np.zeros((2, 3, 3)))


def test_shape_places_the_bodies(shape):
    assert shape.names[0] == "trunk" and len(shape.names) == 13
    positions, rotations = shape.place(home_qpos(1.0, 2.0, yaw=math.pi / 2))
    assert np.allclose(positions[0], [1.0, 2.0, 0.38])
    assert np.allclose(rotations[0][:, 0], [0, 1, 0])
    assert np.allclose(positions[shape.names.index("FL_hip")], [1.0 - 0.051, 2.0 + 0.2407, 0.38])
    trunk = np.concatenate([body.vertices for body in shape.bodies if body.body == "trunk"])
    assert np.allclose(trunk.min(0), [-0.311, -0.1045, -0.056], atol=1e-4)
    assert np.allclose(trunk.max(0), [0.3386, 0.1045, 0.056], atol=1e-4)
    low = min((b.vertices @ r.T + p)[:, 2].min() for b in shape.bodies if b.body.endswith("calf")
              for p, r in [(positions[shape.names.index(b.body)], rotations[shape.names.index(b.body)])])  # fmt: skip
    assert low == pytest.approx(0.0, abs=0.02)


def test_homes_are_cut_low_and_keep_their_colours():
    walls = Boxes(np.array([[0, 2, 0, 4, 0.1, 0, 2.5]]))
    furniture = Boxes(np.array([[1, 0, 0, 0.5, 0.5, 0, 1.8], [0, 0, 0, 1, 1, 1.5, 2.0]]))
    inside = np.ones(FRAME.shape, bool)
    plan = FloorPlan("room", "room", walls, furniture, inside, inside, FRAME)
    scene = plan_scene(plan, Blocks(np.array([[1, 1, 0, 0.3, 0.2, 0.15]])), goal=(2.0, 1.0))
    assert scene.vertices[:, 2].max() <= 1.0
    # A wall, one piece of furniture (the other hangs above the cut), a block, the goal (and one hidden face).
    assert len(scene.faces) == len(scene.colours) == 4 * 12 + 1
    assert np.allclose(scene.colours[24], BLOCK) and np.allclose(scene.colours[36], GOAL)


def test_chase_camera_is_behind_and_above():
    view = ChaseCamera().follow(np.array([1.0, 2.0, 0.3]), math.pi / 2)
    assert view.position[1] < 1.0 and view.position[0] == pytest.approx(1.0) and view.position[2] > 1.0
    assert view.rotation[:, 0] @ [0, 1, -0.5] > 0


def test_chase_camera_looks_over_walls(shape):
    scene = plain_scene(WALL_BEHIND, [(1.0, 1.0, 1.0)], FRAME)
    renderer = RayRenderer(scene, shape.bodies, shape.names)
    free = ChaseCamera().follow(np.array([0.0, 0.0, 0.3]), 0.0)
    assert not renderer.sees(free.position, np.array([0.0, 0.0, 0.3]))
    raised = ChaseCamera(renderer).follow(np.array([0.0, 0.0, 0.3]), 0.0)
    assert renderer.sees(raised.position, np.array([0.0, 0.0, 0.3]))
    assert raised.position[2] > free.position[2]


def test_chase_camera_moves_smoothly(shape):
    renderer = RayRenderer(plain_scene(WALL_BEHIND, [(1.0, 1.0, 1.0)], FRAME), shape.bodies, shape.names)
    camera = ChaseCamera(renderer)
    path = [camera.follow(np.array([x, 0.0, 0.3]), math.pi - 0.02 * k).position
            for k, x in enumerate(np.linspace(-3, 3, 200))]  # fmt: skip
    assert np.linalg.norm(np.diff(path, axis=0), axis=1).max() < 0.4
