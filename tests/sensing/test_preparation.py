"""Pixels without a return, before the network: filled as one would by hand, marked, or left as they are."""

import numpy as np
import pytest
import torch

from vinl.config.errors import InputError
from vinl.robot.cameras import Camera
from vinl.sensing.preparation import MARK, fill_missing, prepare_depth


def fill_by_hand(image: np.ndarray, lost: np.ndarray) -> np.ndarray:
    filled, rows = np.zeros_like(image), []
    for i, row in enumerate(image):
        kept = np.flatnonzero(~lost[i])
        if len(kept):
            rows.append(i)
            for j in range(len(row)):
                away = np.abs(kept - j)
                filled[i, j] = row[kept[away == away.min()]].min()
    for i in set(range(len(image))) - set(rows) if rows else ():
        away = np.abs(np.array(rows) - i)
        filled[i] = filled[max(np.array(rows)[away == away.min()])]
    return filled


@pytest.mark.parametrize("kind", [torch.float32, torch.float16])
def test_lost_pixels_read_as_their_nearest_neighbour(kind):
    generator = torch.Generator().manual_seed(3)
    image = torch.rand(6, 7, 10, generator=generator).to(kind)
    lost = torch.rand(6, 7, 10, generator=generator) < 0.6
    lost[1], lost[2, 3:5], lost[3, 0], lost[4] = True, True, True, False
    seen = fill_missing(torch.where(lost, torch.nan, image), lost)
    assert seen.dtype == kind
    for k in range(6):
        np.testing.assert_array_equal(seen[k].numpy(), fill_by_hand(image[k].numpy(), lost[k].numpy()))
    assert (seen[1] == 0).all() and torch.equal(seen[4], image[4])


def test_the_camera_says_what_becomes_of_them():
    camera = Camera("navigation", (0.3, 0.0, 0.0), 0.0, 1.5, 4, 1, 10.0)
    depth = torch.tensor([[[2.0, 0.0, torch.nan, 12.0]]])

    def prepare(missing: str) -> list[float]:
        return prepare_depth(Camera(**{**camera.describe(), "missing": missing}), depth)[0, 0].tolist()

    assert prepare("fill") == pytest.approx([0.2, 0.2, 0.2, 0.2])  # as a real camera, which sees nothing beyond
    assert prepare("plane") == pytest.approx([0.2, MARK, MARK, 1.0])
    assert prepare("as_is")[:2] == pytest.approx([0.2, 0.0])
    with pytest.raises(InputError, match="missing"):
        prepare("guess")
