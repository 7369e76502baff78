"""Where robots have been, as they see it: their trail behind them, wherever they turn; it fades, and ends with the
episode."""

import math

import pytest
import torch

from vinl.policies.places import FADE, SIDE, VIEW, blank_places, view_places, visit_places

MIDDLE = VIEW // 2


def walk(path: list[tuple[float, float]], fresh: bool = False) -> torch.Tensor:
    places = blank_places(1)
    for k, spot in enumerate(path):
        new = torch.tensor([fresh and k == len(path) - 1])
        places = visit_places(places, torch.tensor([spot]), new)
    return places


@pytest.mark.parametrize(("yaw", "began"), [(0.0, (MIDDLE + 2, MIDDLE)), (math.pi / 2, (MIDDLE, MIDDLE - 2))])
def test_the_trail_is_seen_from_where_the_robot_looks(yaw, began):
    """Two steps along x: the trail lies behind a robot that looks ahead, to the left of one that has turned left."""
    path = [(0.5, 0.5), (1.5, 0.5), (2.5, 0.5)]
    seen = view_places(walk(path), torch.tensor([path[-1]]), torch.tensor([yaw])).reshape(VIEW, VIEW)
    assert seen[MIDDLE, MIDDLE] == 1.0 and int((seen > 0).sum()) == 3
    assert seen[began] == pytest.approx(FADE**2)


def test_it_fades_and_ends_with_the_episode():
    path = [(0.5 + SIDE * k, 0.5) for k in range(5)]
    assert walk(path).max() == 1.0 and walk(path).sum() == pytest.approx(sum(FADE**k for k in range(5)))
    assert walk(path, fresh=True).sum() == 1.0


def test_places_below_zero_are_places_too():
    seen = view_places(walk([(-3.2, -40.6)]), torch.tensor([[-3.9, -40.1]]), torch.zeros(1)).reshape(VIEW, VIEW)
    assert seen[MIDDLE, MIDDLE] == 1.0 and seen.sum() == 1.0
