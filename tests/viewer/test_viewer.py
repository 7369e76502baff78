"""The page without a browser: what is drawn of every kind of snapshot, and where clicks meet the floor."""

import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import vinl
from vinl.viewer.scene_view import LAYERS, inside_mesh
from vinl.viewer.session import Drive, OpenPlan, ScatterClutter, SetGoal, Snapshot, ToggleBlock
from vinl.viewer.viewer import Viewer, render_status


def wait_until_drawn(viewer: Viewer, condition: Callable[[Snapshot], bool] = lambda _: True) -> Snapshot:
    """The first snapshot on the page that fulfils a condition."""
    end = time.monotonic() + 60
    while time.monotonic() < end:
        assert viewer.error is None and viewer.session.error is None
        if viewer.shown is not None and condition(viewer.shown):
            return viewer.shown
        time.sleep(0.005)
    raise AssertionError(f"never drawn; last: {render_status(viewer.session.snapshot)}")


@pytest.fixture
def viewer() -> Viewer:
    return vinl.play("harbour_flat", "rough", "oracle", obstacles="none", seed=1)


def test_everything_is_drawn(viewer: Viewer):
    x, y = viewer.session.snapshot.qpos[:2]
    viewer.session.ask(SetGoal(x + 1.0, y))
    wait_until_drawn(viewer, lambda s: s.goal is not None)
    viewer.session.ask(ToggleBlock(x + 0.8, y))
    wait_until_drawn(viewer, lambda s: len(s.world.blocks) == 1)
    viewer.session.ask(ScatterClutter("paper"))
    wait_until_drawn(viewer, lambda s: len(s.world.blocks) > 1)
    viewer.session.ask(Drive(0.3, 0.2))
    driven = wait_until_drawn(viewer, lambda s: s.state == "driven")
    for layer in LAYERS:
        viewer.scene.show(layer, False)
        viewer.scene.show(layer, True)
    wait_until_drawn(viewer, lambda s: s.time_s > driven.time_s)
    viewer.session.ask(OpenPlan("mill_loft"))
    wait_until_drawn(viewer, lambda s: s.world.plan.name == "mill_loft")
    assert f'src="{viewer.url}"' in viewer._repr_html_() and repr(viewer) == f"Viewer({viewer.url})"
    viewer.close()


def test_points_of_the_scene_are_points_of_the_plan(viewer: Viewer):
    robot = wait_until_drawn(viewer).qpos
    np.testing.assert_allclose(viewer.scene.to_world(np.zeros(3))[:2], robot[:2], atol=0.05)  # it follows the robot
    viewer.scene.centre_plan()
    cells = np.argwhere(viewer.session.snapshot.world.plan.inside)
    frame = viewer.session.snapshot.world.plan.frame
    middle = (frame.xy(cells.min(0)) + frame.xy(cells.max(0))) / 2
    np.testing.assert_allclose(viewer.scene.to_world(np.zeros(3))[:2], middle)
    viewer.close()


def test_recording_is_drawn(folder: Path):
    viewer = vinl.replay(folder, 1)
    drawn = wait_until_drawn(viewer)
    assert drawn.paused and "of 1.2 s" in render_status(drawn)
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
