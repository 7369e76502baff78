"""The page without a browser: what is drawn of every kind of snapshot, and where clicks meet the floor."""

import time
from pathlib import Path

import numpy as np
import pytest

import vinl
from vinl.viewer.scene_view import LAYERS, inside_mesh
from vinl.viewer.session import Drive, OpenPlan, ScatterClutter, SetGoal, ToggleBlock
from vinl.viewer.viewer import Viewer, render_status


def wait_until_drawn(viewer: Viewer) -> None:
    """Until the latest snapshot can be expected to be on the page."""
    time.sleep(0.5)
    assert viewer.error is None and viewer.session.error is None


@pytest.fixture
def viewer() -> Viewer:
    return vinl.play("harbour_flat", "rough", "oracle", obstacles="none", seed=1)


def test_everything_is_drawn(viewer: Viewer):
    x, y = viewer.session.snapshot.qpos[:2]
    for request in (SetGoal(x + 1.0, y), ScatterClutter("paper"), ToggleBlock(x + 0.8, y), Drive(0.3, 0.2)):
        viewer.session.ask(request)
        wait_until_drawn(viewer)
    for layer in LAYERS:
        viewer.scene.show(layer, False)
        viewer.scene.show(layer, True)
    wait_until_drawn(viewer)
    viewer.session.ask(OpenPlan("mill_loft"))
    time.sleep(1.0)
    wait_until_drawn(viewer)
    assert viewer.session.snapshot.world.plan.name == "mill_loft"
    assert f'src="{viewer.url}"' in viewer._repr_html_() and repr(viewer) == f"Viewer({viewer.url})"
    viewer.close()


def test_points_of_the_scene_are_points_of_the_plan(viewer: Viewer):
    wait_until_drawn(viewer)
    robot = viewer.session.snapshot.qpos
    np.testing.assert_allclose(viewer.scene.to_world(np.zeros(3))[:2], robot[:2], atol=0.05)  # it follows the robot
    viewer.scene.centre_plan()
    cells = np.argwhere(viewer.session.snapshot.world.plan.inside)
    frame = viewer.session.snapshot.world.plan.frame
    middle = (frame.xy(cells.min(0)) + frame.xy(cells.max(0))) / 2
    np.testing.assert_allclose(viewer.scene.to_world(np.zeros(3))[:2], middle)
    viewer.close()


def test_recording_is_drawn(folder: Path):
    viewer = vinl.replay(folder, 1)
    wait_until_drawn(viewer)
    assert viewer.session.snapshot.paused and "of 1.2 s" in render_status(viewer.session.snapshot)
    viewer.close()


def test_floor_covers_the_inside_and_no_more():
    plan = vinl.load_floorplan("harbour_flat")
    vertices, faces = inside_mesh(plan)
    a, b, c = np.moveaxis(vertices[faces], 1, 0)
    assert (np.cross(b - a, c - a)[:, 2] > 0).all()  # seen from above
    corners = vertices[:, :2].reshape(-1, 4, 2)
    x, y = plan.frame.centres()
    covered = np.zeros(plan.inside.shape, bool)
    for low, high in zip(corners.min(1), corners.max(1), strict=True):
        covered |= ((y > low[1]) & (y < high[1]))[:, None] & (x > low[0]) & (x < high[0])
    np.testing.assert_array_equal(covered, plan.inside)
