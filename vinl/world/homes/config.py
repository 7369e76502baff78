"""What procedural homes are like."""

from __future__ import annotations

from dataclasses import dataclass, replace

from vinl.config.errors import InputError
from vinl.config.limits import Range, check_limits

RANGES = {
    "area": (30.0, 1000.0),
    "door_width": (0.6, 2.0),
    "door_height": (1.8, 3.0),
    "wall_height": (2.0, 6.0),
    "inner_wall": (0.05, 0.6),
    "outer_wall": (0.05, 0.6),
    "corridor_width": (1.0, 3.0),
    "furniture_density": (0.0, 2.0),
}
"""What each range of ``HomeConfig`` may lie in."""


LAYOUTS = ("home", "dead_ends", "office", "narrow")
"""What generated floors are: homes; homes whose rooms and doors make a tree, so that one leaves most rooms by the door
that one came in by; office floors; homes with thick walls, narrow doors, and gaps that are too narrow for a robot."""

WIDE = 0.75
"""Corridors leave at least so much between their walls; doors that do are found on coarse cells too [m]."""


@dataclass(frozen=True)
class HomeConfig:
    """Ranges and fractions that homes are drawn from. Every range is (least, most), both included.

    Attributes:
        layout: one of ``LAYOUTS``; of an office the fractions of corridors, wings, open plans and lofts are not
            read, and homes with dead ends have no open plan, passage or second door.
        area: floor between the middle lines of the outer walls [m2]; small homes are drawn more often than large ones.
        door_width: clear width of doors [m].
        door_height: height of doors, below the lintel [m].
        wall_height: height of all walls of a home [m].
        inner_wall: thickness of the walls between rooms, one for all of a home [m].
        outer_wall: thickness of the walls to the outside, at least that of the inner ones [m].
        corridor_width: width of a corridor between the middle lines of its walls [m].
        corridor_share: fraction of homes whose rooms lie along a corridor; the others are split into rooms at random.
        l_shape_share: fraction of homes of two wings.
        open_plan_share: fraction of homes whose living room and kitchen, at times also the corridor, are one.
        loft_share: fraction of homes that are one large room, with few small ones cut off.
        passage_share: fraction of the doors to living rooms, kitchens and corridors that are open passages of 1.3 m to
            2.4 m.
        loop_share: probability of a second door where two of those rooms touch that are connected already.
        furniture_density: how full rooms are; 0 is bare, 1 as lived in, above 1 crowded.
        bare_share: fraction of homes without furniture, walls only.
        askew_share: probability that a piece of furniture stands turned or in the way instead of at its wall.
        gaps: passages for each 100 m2 that something in the way narrows to less than a robot needs, where there is
            another way.
    """

    layout: str = "home"
    area: Range = (40.0, 250.0)
    door_width: Range = (0.75, 1.2)
    door_height: Range = (1.95, 2.2)
    wall_height: Range = (2.3, 3.4)
    inner_wall: Range = (0.08, 0.2)
    outer_wall: Range = (0.15, 0.3)
    corridor_width: Range = (1.1, 1.9)
    corridor_share: float = 0.45
    l_shape_share: float = 0.35
    open_plan_share: float = 0.35
    loft_share: float = 0.12
    passage_share: float = 0.3
    loop_share: float = 0.3
    furniture_density: Range = (0.4, 1.7)
    bare_share: float = 0.06
    askew_share: float = 0.1
    gaps: float = 0.0

    def __post_init__(self) -> None:
        if self.layout not in LAYOUTS:
            raise InputError(f"homes: layout must be one of {', '.join(LAYOUTS)}, got {self.layout!r}")
        check_limits(
            self,
            "homes: ",
            gaps=(0.0, 50.0),
            **RANGES,
            **{name: (0.0, 1.0) for name in vars(self) if name.endswith("_share")},
        )
        if self.area[1] < 1.05 * self.area[0]:
            raise InputError(f"homes: area needs some room between least and most, got {self.area}")
        if self.door_height[1] > self.wall_height[0]:
            raise InputError("homes: the highest door must not be higher than the lowest wall")
        if self.corridor_width[0] - max(self.inner_wall[1], self.outer_wall[1]) < WIDE:
            raise InputError(f"homes: a corridor less its walls must be {WIDE:g} m wide or more")

    @property
    def has_narrow_doors(self) -> bool:
        """Whether doors may be so narrow that paths have to be checked on fine cells."""
        return self.door_width[0] < WIDE


_OWN = {
    "dead_ends": {"area": (80.0, 300.0)},
    "narrow": {
        "door_width": (0.6, 0.95),
        "inner_wall": (0.08, 0.6),
        "outer_wall": (0.15, 0.6),
        "corridor_width": (1.35, 2.2),
        "loop_share": 0.9,
        "bare_share": 0.2,
        "gaps": 6.0,
    },
    "office": {
        "area": (150.0, 600.0),
        "corridor_width": (1.4, 2.6),
        "door_width": (0.8, 1.1),
        "furniture_density": (0.3, 1.2),
        "loop_share": 0.1,
    },
}
"""What each layout has of its own."""


def layout_config(layout: str, config: HomeConfig | None = None) -> HomeConfig:
    """Another layout with the walls, doors and furniture of a configuration, but sizes of its own. Raises
    ``InputError`` if there is no such layout."""
    return replace(config or HomeConfig(), layout=layout, **_OWN.get(layout, {}))
