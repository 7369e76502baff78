"""Office floors and homes with dead ends: as large as asked for, in one piece, the same again, kept for judging."""

from dataclasses import replace
from random import Random

import numpy as np
import pytest

from vinl.config.errors import InputError
from vinl.world.floorplan import measure_clearance
from vinl.world.free_space import FIT_RADIUS, distance_field, read_field
from vinl.world.homes import generate_home
from vinl.world.homes.config import HomeConfig, layout_config
from vinl.world.homes.generate import JUDGING_SETS, RESERVED_FROM, JudgingSet, draw_shell, find_judging_set
from vinl.world.raster import label_regions


def count_doors(seed: int, config: HomeConfig) -> tuple[int, int, int]:
    """Rooms, doors between them, and rooms with a single door."""
    shell = draw_shell(Random(seed), config)
    pairs = [edge.rooms for edge in shell.edges for _ in edge.gaps if min(edge.rooms) >= 0]
    each = np.bincount(np.array(pairs).ravel(), minlength=len(shell.rooms))
    return len(shell.rooms), len(pairs), int((each == 1).sum())


@pytest.mark.parametrize("layout", ["dead_ends", "office", "narrow"])
def test_every_floor_is_in_one_piece_and_of_its_size(layout):
    config = layout_config(layout)
    for seed in range(6):
        plan = generate_home(seed, config)
        again = generate_home(seed, config)
        assert np.array_equal(plan.boxes.rows, again.boxes.rows)
        regions = label_regions(measure_clearance(plan.free, plan.frame.resolution) >= FIT_RADIUS)
        sizes = np.bincount(regions.ravel())[1:] * plan.frame.resolution**2
        assert (np.sort(sizes)[:-1] < 1.0).all()  # all but pockets behind furniture
        floor = plan.inside.sum() * plan.frame.resolution**2
        assert 0.8 * config.area[0] < floor < 1.05 * config.area[1]


def test_rooms_of_homes_with_dead_ends_make_a_tree():
    single, rooms = 0, 0
    for seed in range(20):
        count, doors, alone = count_doors(seed, layout_config("dead_ends"))
        assert doors == count - 1  # no way around
        single, rooms = single + alone, rooms + count
    assert single > 0.35 * rooms
    loops = [count_doors(seed, HomeConfig()) for seed in range(20)]
    assert sum(doors for _, doors, _ in loops) > sum(count - 1 for count, _, _ in loops)


def test_gaps_close_ways_and_no_room():
    """Between the same places paths are longer by metres here and there, and none is gone."""
    config, added, longer = layout_config("narrow"), 0, 0
    for seed in range(6):
        plan, plain = (generate_home(seed, replace(config, gaps=gaps)) for gaps in (config.gaps, 0.0))
        more = len(plan.boxes.rows) - len(plain.boxes.rows)
        assert 0 <= more <= config.gaps * plan.inside.sum() * plan.frame.resolution**2 / 100 + 1
        added += more
        clear = [measure_clearance(home.free, home.frame.resolution) >= FIT_RADIUS for home in (plan, plain)]
        cells = np.argwhere(clear[0])[:: max(int(clear[0].sum() / 40), 1)]
        for cell in cells[::4]:
            paths = [distance_field(floor, plan.frame, plan.frame.xy(cell)) for floor in clear]
            after, before = (read_field(field, plan.frame, plan.frame.xy(cells)) for field in paths)
            there = np.isfinite(before)
            assert np.isfinite(after[there]).mean() > 0.95  # but for pockets
            both = there & np.isfinite(after)
            assert (after[both] > before[both] - 0.01).all()
            longer += (after[both] > before[both] + 2.0).any()
    assert added >= 6 and longer >= 6


def test_offices_have_corridors_that_the_rooms_open_onto():
    rings = 0
    for seed in range(20):
        shell = draw_shell(Random(seed), layout_config("office"))
        kinds = [room.kind for room in shell.rooms]
        assert kinds.count("hall") == 1 and kinds.count("bureau") + kinds.count("meeting") >= 4
        hall = kinds.index("hall")
        onto = {k for edge in shell.edges if edge.gaps and hall in edge.rooms for k in edge.rooms}
        assert len(onto) > 0.6 * len(kinds)
        rings += len(shell.rooms[hall].rects) == 4
    assert rings >= 2


def test_sets_for_judging_are_fixed():
    for name, judged in JUDGING_SETS.items():
        assert judged.first_seed >= RESERVED_FROM and judged.count == 20 and find_judging_set(name) is judged
    plans = JudgingSet("dead_ends", 2_100_000_000, 2).generate()
    assert [plan.name for plan in plans] == ["home-2100000000", "home-2100000001"]
    assert len(plans[0].boxes) == len(generate_home(2_100_000_000, layout_config("dead_ends")).boxes)
    with pytest.raises(InputError, match="offices"):
        find_judging_set("office")
    with pytest.raises(InputError, match="layout"):
        layout_config("castle")
