"""What the tests' own checks of shapes and types leave out is no call that differs from those before it."""

import numpy as np
import pytest
import sparing_checks
from beartype import beartype
from jaxtyping import Float, TypeCheckError


def test_a_wrong_argument_is_found_after_any_number_of_right_ones():
    called = []

    @sparing_checks._check_sparingly(typechecker=beartype)
    def rotate(points: Float[np.ndarray, "n 3"], angle: float) -> Float[np.ndarray, "n 3"]:
        called.append(angle)
        return points if angle < 2.0 else points[:, :2]

    right = np.zeros((4, 3))
    for _ in range(200):
        rotate(right, angle=1.0)
    for points, angle in ((np.zeros((4, 2)), 1.0), (np.zeros((4, 3), int), 1.0), ([0.0], 1.0), (right, "1")):
        for _ in range(2):  # not only at its first sight
            with pytest.raises(TypeCheckError):
                rotate(points, angle=angle)
    assert len(called) == 200
    sparing_checks.begin_test()
    with pytest.raises(TypeCheckError):
        rotate(right, angle=3.0)  # what it returns has another shape
