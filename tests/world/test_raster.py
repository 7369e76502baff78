import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays
from scipy.ndimage import label

from vinl.config.errors import InputError
from vinl.world.boxes import Boxes
from vinl.world.grid import GridFrame
from vinl.world.raster import drop_specks, paint_boxes, split_rectangles

masks = arrays(bool, array_shapes(min_dims=2, max_dims=2, max_side=14))


@given(masks)
def test_rectangles_cover_exactly_the_mask(mask):
    covered = np.zeros_like(mask)
    for r0, c0, r1, c1 in split_rectangles(mask):
        assert mask[r0:r1, c0:c1].all()
        covered[r0:r1, c0:c1] = True
    assert (covered == mask).all()


def test_noise_is_not_made_into_boxes():
    with pytest.raises(InputError, match="min-speck"):
        split_rectangles(np.indices((40, 40)).sum(0) % 2 == 0, limit=100)


def test_walls_become_few_rectangles():
    mask = np.zeros((100, 120), bool)
    mask[[0, 1, -1, -2]] = mask[:, [0, 1, -1, -2]] = True
    mask[50:52] = mask[:, 60:62] = True
    assert len(split_rectangles(mask)) == 6
    assert len(split_rectangles(np.ones((30, 40), bool))) == 1
    assert len(split_rectangles(np.zeros((3, 3), bool))) == 0


def test_specks_are_joined_over_corners():
    mask = np.zeros((8, 8), bool)
    mask[0, 0] = mask[1, 1] = mask[2, 2] = mask[6, 6] = True
    kept = drop_specks(mask, 2)
    assert kept[1, 1] and not kept[6, 6]
    assert (drop_specks(mask, 0) == mask).all()
    assert not drop_specks(mask, 4).any()


@given(st.floats(-3.1, 3.1), st.floats(0.3, 3.0), st.floats(0.3, 3.0))
def test_painted_area_is_the_box_area(yaw, length, width):
    frame = GridFrame(-3.0, -3.0, 0.05, (121, 121))
    grid = paint_boxes(Boxes(np.array([[0.1, -0.2, yaw, length, width, 0, 1.0]])), frame)
    assert grid.sum() * 0.05**2 == pytest.approx(length * width, abs=0.06 * (length + width))


def test_a_wall_thinner_than_a_cell_lets_nothing_through():
    frame = GridFrame(0.0, 0.0, 0.05, (60, 60))
    for yaw in (0.0, 0.3, np.pi / 4):
        grid = paint_boxes(Boxes(np.array([[1.48, 1.48, yaw, 9.0, 0.01, 0, 1.0]])), frame)
        assert label(~grid)[1] == 2
