import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vinl.config.errors import InputError
from vinl.world.free_space import comfortable_path, distance_field, path_length, read_field
from vinl.world.grid import GridFrame

FRAME = GridFrame(0.0, 0.0, 0.05, (80, 120))
OPEN = np.ones(FRAME.shape, bool)
cells = st.tuples(st.integers(0, 79), st.integers(0, 119))


def walled():
    """A wall across the middle with one door far up."""
    mask = OPEN.copy()
    mask[:70, 58:62] = False
    return mask


@given(cells, cells)
def test_open_floor_is_measured_within_two_percent(a, b):
    start, goal = FRAME.xy(np.array(a)), FRAME.xy(np.array(b))
    straight = np.linalg.norm(goal - start)
    distance = distance_field(OPEN, FRAME, goal)[a]
    assert straight - 1e-5 <= distance <= 1.02 * straight + 1e-5


def test_around_a_wall():
    start, goal = np.array([1.0, 1.0]), np.array([5.0, 1.0])
    field = distance_field(walled(), FRAME, goal)
    around = 2 * np.hypot(1.9, 2.5) + 0.2
    assert read_field(field, FRAME, start) == pytest.approx(around, rel=0.03)


def test_the_comfortable_way_keeps_off_the_walls():
    from scipy.ndimage import distance_transform_edt

    mask = walled()
    clearance = np.asarray(distance_transform_edt(mask)) * 0.05
    start, goal = np.array([1.0, 1.0]), np.array([5.0, 1.0])
    path = comfortable_path(mask, clearance, FRAME, start, goal)
    cell, shortest = FRAME.cell(path), float(read_field(distance_field(mask, FRAME, goal), FRAME, start))
    assert mask[cell[:, 0], cell[:, 1]].all()
    assert clearance[cell[:, 0], cell[:, 1]].min() > 0.2  # the shortest one grazes the corner
    assert shortest <= path_length(path) < 1.15 * shortest
    assert np.allclose(path[[0, -1]], [start, goal])
    assert np.linalg.norm(np.diff(path, axis=0), axis=1).max() <= 0.1 + 1e-9


def test_no_way_is_infinite_or_an_error():
    mask = walled()
    mask[:, 58:62] = False
    field = distance_field(mask, FRAME, np.array([5.0, 1.0]))
    assert np.isinf(field[20, 20]) and np.isinf(read_field(field, FRAME, np.array([1.0, 1.0])))
    with pytest.raises(InputError):
        comfortable_path(mask, np.ones(FRAME.shape), FRAME, np.array([1.0, 1.0]), np.array([5.0, 1.0]))
    with pytest.raises(InputError, match="not on floor"):
        distance_field(np.zeros_like(mask), FRAME, np.array([1.0, 1.0]))


def test_points_just_off_the_floor_are_moved_onto_it():
    goal = np.array([3.0, 0.5])  # in the wall
    field = distance_field(walled(), FRAME, goal)
    assert np.isfinite(read_field(field, FRAME, np.array([1.0, 1.0])))
