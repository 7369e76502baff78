"""What an episode's end is put down to."""

from dataclasses import replace

import numpy as np
import pytest
from small_home import RECORD

from vinl.chain.metrics import FAILURES, count_failures, find_cause, measure_distance, read_failure
from vinl.chain.robot import KINDS
from vinl.world.boxes import Blocks
from vinl.world.endings import END_REASONS, name_late_end
from vinl.world.floorplan import FloorPlan
from vinl.world.free_space import FreeSpace

MIDDLE = np.array([2.25, 3.5])


def touch(time: float, kind: str) -> list[float]:
    return [time, float(KINDS.index(kind)), 0.0, 0.0]


def test_out_of_time() -> None:
    assert name_late_end(True, 50.0, 5.0) == "stuck"
    assert name_late_end(False, 15.1, 5.0) == "looping"
    assert name_late_end(False, 14.9, 5.0) == "timeout"


def test_what_was_touched_most(two_rooms: FloorPlan) -> None:
    space, none = FreeSpace(two_rooms), Blocks.empty()
    touches = np.array([touch(1.0, "foot_wall"), touch(1.02, "foot_wall"), touch(1.04, "leg_wall")])
    touches = np.vstack([touches, [touch(9.5, "foot_block"), touch(9.52, "leg_block"), touch(9.52, "trunk_wall")]])
    assert find_cause(MIDDLE, touches, 9.0, space, none) == "block"
    assert find_cause(MIDDLE, touches, 0.0, space, none) == "wall"
    assert find_cause(MIDDLE, touches, 9.6, space, none) == "free"


def test_what_is_near_where_nothing_was_touched(two_rooms: FloorPlan) -> None:
    space, none = FreeSpace(two_rooms), np.zeros((0, 4))
    block = Blocks(np.array([[2.25, 3.5 + 0.4, np.pi / 2, 0.2, 0.5, 0.1]]))
    assert measure_distance(MIDDLE, block) == pytest.approx(0.3)
    assert find_cause(MIDDLE, none, 0.0, space, block) == "block"
    assert find_cause(MIDDLE, none, 0.0, space, Blocks.empty()) == "free"
    assert find_cause(np.array([0.4, 3.5]), none, 0.0, space, Blocks.empty()) == "wall"
    assert find_cause(np.array([-9.0, 99.0]), none, 0.0, space, Blocks.empty()) == "wall"  # thrown out of the house


def test_every_failure_is_counted_once() -> None:
    records = [replace(RECORD, success=reason == "success", end_reason=reason) for reason in END_REASONS]
    records += [replace(RECORD, success=False, end_reason="stuck", end_at="wall")]
    counts = count_failures(records)
    assert counts == {
        "fall": {"block": 0, "wall": 0, "free": 1},
        "stuck": {"block": 0, "wall": 1, "free": 1},
        "looping": 1,
        "timeout": 1,
    }
    assert sum(read_failure(counts, reason, cause) for reason, cause, _ in FAILURES) == len(records) - 1
