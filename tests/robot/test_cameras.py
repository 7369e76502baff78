import math
from dataclasses import replace

import numpy as np
import pytest

from vinl.config.errors import InputError
from vinl.robot.cameras import LOCOMOTION_CAMERA, NAVIGATION_CAMERA, Camera


@pytest.mark.parametrize("camera, down", [(LOCOMOTION_CAMERA, 30), (NAVIGATION_CAMERA, -15)], ids=lambda c: str(c)[:12])
def test_axes(camera, down):
    rotation = camera.rotation()
    assert np.allclose(rotation @ rotation.T, np.eye(3)) and np.linalg.det(rotation) == pytest.approx(1)
    assert rotation[2, 0] == pytest.approx(-math.sin(math.radians(down)))  # the optical axis dips
    assert np.allclose(rotation[:, 1], [0, 1, 0])


def test_pixels_are_square():
    tx, ty = NAVIGATION_CAMERA.tan_half
    assert tx == pytest.approx(math.tan(math.radians(35))) and ty / tx == pytest.approx(48 / 80)


def test_normalise():
    depth = np.array([-1.0, 0.0, 1.0, 2.0, 5.0, np.inf])
    assert np.allclose(LOCOMOTION_CAMERA.normalise(depth), [0, 0, 0.5, 1, 1, 1])


def test_description_makes_the_same_camera_again():
    assert Camera(**LOCOMOTION_CAMERA.describe()) == LOCOMOTION_CAMERA


@pytest.mark.parametrize("change", [{"hfov": 0.0}, {"hfov": 4.0}, {"width": 0}, {"far": -1.0}])
def test_impossible_cameras(change):
    with pytest.raises(InputError, match="locomotion"):
        replace(LOCOMOTION_CAMERA, **change)
