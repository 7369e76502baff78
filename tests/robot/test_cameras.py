import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import vinl
from vinl.config.errors import InputError
from vinl.config.loader import load_config
from vinl.loco.config import LocoConfig
from vinl.nav.config import NavCameraConfig, NavConfig
from vinl.policies.io import list_policies
from vinl.robot.cameras import LOCOMOTION_CAMERA, NAVIGATION_CAMERA, Camera

CAMERAS = {"locomotion": LOCOMOTION_CAMERA, "navigation": NAVIGATION_CAMERA}


@pytest.mark.parametrize(
    "camera, down",
    [(LOCOMOTION_CAMERA, 30), (replace(NAVIGATION_CAMERA, pitch_down=-0.2), -11.46)],
    ids=lambda c: str(c)[:12],
)
def test_axes(camera, down):
    rotation = camera.rotation()
    assert np.allclose(rotation @ rotation.T, np.eye(3)) and np.linalg.det(rotation) == pytest.approx(1)
    assert rotation[2, 0] == pytest.approx(-math.sin(math.radians(down)), abs=1e-3)  # the optical axis dips
    assert np.allclose(rotation[:, 1], [0, 1, 0])


def test_pixels_are_square():
    tx, ty = NAVIGATION_CAMERA.tan_half
    assert tx == pytest.approx(1.0, abs=1e-5) and ty / tx == pytest.approx(60 / 80)


def test_normalise():
    depth = np.array([-1.0, 0.0, 1.0, 2.0, 5.0, np.inf])
    assert np.allclose(LOCOMOTION_CAMERA.normalise(depth), [0, 0, 0.5, 1, 1, 1])


def test_description_makes_the_same_camera_again():
    assert Camera(**LOCOMOTION_CAMERA.describe()) == LOCOMOTION_CAMERA


@pytest.mark.parametrize("change", [{"hfov": 0.0}, {"hfov": 4.0}, {"width": 0}, {"far": -1.0}])
def test_impossible_cameras(change):
    with pytest.raises(InputError, match="locomotion"):
        replace(LOCOMOTION_CAMERA, **change)


@pytest.mark.parametrize("name", list_policies())
def test_shipped_policies_see_through_the_robots_cameras(name):
    camera = vinl.load_policy(name).camera
    marks = {"missing": "plane"} if name in ("loco", "mlp") else {}  # told which pixels did not return
    assert camera is None or camera == replace(CAMERAS[camera.name], **marks)


def test_trainings_begin_with_the_robots_cameras():
    student, navigator = load_config(LocoConfig, "loco/student").student, load_config(NavConfig, "nav/default").camera
    assert student is not None and navigator is not None
    marked = replace(LOCOMOTION_CAMERA, missing="plane")
    assert (student.camera.record(), navigator.record()) == (marked, NAVIGATION_CAMERA)
    assert NavCameraConfig().record() == NAVIGATION_CAMERA


def test_the_page_on_the_robot_names_its_cameras():
    page = (Path(vinl.__file__).parents[1] / "docs" / "robot.md").read_text(encoding="utf-8")
    for camera in (LOCOMOTION_CAMERA, NAVIGATION_CAMERA):
        down, wide = round(math.degrees(camera.pitch_down)), round(math.degrees(camera.hfov))
        row = f"{camera.position[0]}, 0, 0 m | {f'{down} deg down' if down else 'level'} | {wide} deg | "
        assert row + f"{camera.width} x {camera.height} | {camera.far:.0f} m" in page
