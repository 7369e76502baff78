"""Maps of a report."""

import re
from dataclasses import replace

import pytest

from vinl.render.drawing import draw_map
from vinl.world.floorplan import FloorPlan
from vinl.world.grid import GridFrame


@pytest.mark.parametrize(("stretch", "metres"), [(1, 2), (1.5, 2), (4, 2), (6, 10), (15, 10)])
def test_homes_share_the_length_of_the_scale_bar(two_rooms: FloorPlan, stretch: float, metres: int) -> None:
    """A home of 9 m, stretched."""
    frame = two_rooms.frame
    wide = replace(two_rooms, frame=GridFrame(frame.x0, frame.y0, stretch * frame.resolution, frame.shape))
    bar = re.search(r'<g class="scale"><path d="M[-\d. ]+h(\d+)"/><text [^>]*>(\d+) m<', draw_map(wide, [], 0, 0.5))
    assert bar is not None and int(bar[1]) == int(bar[2]) == metres
