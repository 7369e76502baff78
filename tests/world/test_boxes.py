"""Footprints of boxes against shapely's polygons."""

import numpy as np
import shapely
from hypothesis import given
from hypothesis import strategies as st

from vinl.world.boxes import Boxes


@given(st.integers(0, 10_000))
def test_distances_and_insides_are_those_of_the_polygons(seed: int) -> None:
    rng = np.random.default_rng(seed)
    places, sizes = rng.uniform(-2, 2, (6, 2)), rng.uniform(0.05, 2, (6, 2))
    boxes = Boxes(np.column_stack([places, rng.uniform(-7, 7, 6), sizes, np.zeros(6), np.ones(6)]))
    points = rng.uniform(-3, 3, (9, 2))
    polygons = np.array([shapely.Polygon(corners) for corners in boxes.corners()])[:, None]
    spots = np.array([shapely.Point(point) for point in points])[None]
    wanted = shapely.distance(polygons, spots)
    np.testing.assert_allclose(boxes.distances(points), wanted, atol=1e-9)
    clear = wanted > 1e-6
    inside = shapely.contains_properly(polygons, spots)
    assert not boxes.contain(points)[clear].any() and boxes.contain(points)[inside].all()


def test_no_boxes_have_no_distances() -> None:
    assert Boxes.empty().distances(np.zeros((3, 2))).shape == (0, 3)
