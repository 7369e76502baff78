"""Generated floors that are kept for judging: named sets, fixed by their seeds; no training draws from them."""

from __future__ import annotations

from dataclasses import dataclass

from vinl.config.errors import InputError
from vinl.config.fields import closest
from vinl.world.floorplan import FloorPlan
from vinl.world.homes.config import layout_config
from vinl.world.homes.generate import generate_home

RESERVED_FROM = 1_000_000_000
"""Seeds from here on are for judging; trainings keep below."""


@dataclass(frozen=True)
class JudgingSet:
    """Floors of one layout from a row of seeds.

    Attributes:
        layout: one of ``vinl.world.homes.config.LAYOUTS``, as ``layout_config`` has it.
        first_seed: of the first floor.
        count: floors.
    """

    layout: str
    first_seed: int
    count: int = 20

    def generate(self) -> list[FloorPlan]:
        """The floors, the same on every machine."""
        config = layout_config(self.layout)
        return [generate_home(seed, config) for seed in range(self.first_seed, self.first_seed + self.count)]


JUDGING_SETS = {
    "offices": JudgingSet("office", 2_000_000_000),
    "dead_ends": JudgingSet("dead_ends", 2_100_000_000),
}
"""20 office floors, and 20 homes whose rooms and doors make a tree."""


def find_judging_set(name: str) -> JudgingSet:
    """The set of a name.

    Raises:
        InputError: there is none.
    """
    if name not in JUDGING_SETS:
        raise InputError(
            f"unknown set of homes {name!r}{closest(name, JUDGING_SETS)}; known: {', '.join(JUDGING_SETS)}"
        )
    return JUDGING_SETS[name]
