"""What belongs into which room."""

from __future__ import annotations

from collections.abc import Callable
from random import Random

from vinl.world.homes import catalogue as make
from vinl.world.homes.catalogue import Things
from vinl.world.homes.rooms import Room

Maker = Callable[[Random], Things]

Wish = tuple[Maker, float, str]
"""How things are made, how likely it is at density 1 (1: nearly always), and where it stands: at a ``wall``, in a
``corner``, about the ``middle`` of a wall, ``free`` before a wall, in the ``centre`` of the room, or anywhere on the
``floor``."""

TABLE: dict[str, list[Wish]] = {
    "bedroom": [
        (make.wardrobe, 0.95, "corner"),
        (make.chest, 0.5, "wall"),
        (make.desk, 0.35, "wall"),
        (make.shelf, 0.3, "wall"),
        (make.armchair, 0.15, "corner"),
    ],
    "child": [
        (make.single_bed, 1.0, "corner"),
        (make.desk, 0.8, "wall"),
        (make.wardrobe, 0.6, "corner"),
        (make.shelf, 0.7, "wall"),
        (make.single_bed, 0.3, "corner"),
        (make.stand, 0.6, "floor"),
    ],
    "dining": [
        (make.dining_table, 1.0, "centre"),
        (make.chest, 0.8, "wall"),
        (make.shelf, 0.4, "wall"),
    ],
    "bath": [
        (make.toilet, 0.95, "wall"),
        (make.basin, 0.95, "wall"),
        (make.washer, 0.4, "corner"),
    ],
    "wc": [(make.toilet, 1.0, "middle"), (make.basin, 0.8, "wall")],
    "store": [
        (make.shelf, 0.9, "wall"),
        (make.shelf, 0.7, "wall"),
        (make.washer, 0.4, "corner"),
        (make.stand, 0.7, "floor"),
    ],
    "office": [
        (make.desk, 1.0, "wall"),
        (make.shelf, 0.9, "wall"),
        (make.shelf, 0.7, "wall"),
        (make.armchair, 0.4, "corner"),
        (make.table_for_two, 0.2, "centre"),
    ],
    "bureau": [
        (make.shelf, 0.9, "wall"),
        (make.shelf, 0.4, "wall"),
        (make.table_for_two, 0.2, "centre"),
    ],
    "meeting": [(make.dining_table, 1.0, "centre"), (make.chest, 0.6, "wall"), (make.shelf, 0.3, "wall")],
    "hall": [(make.shoe_rack, 0.7, "wall"), (make.shoe_rack, 0.3, "wall")],
    "living": [
        (make.television, 0.8, "middle"),
        (make.shelf, 0.8, "wall"),
        (make.armchair, 0.6, "corner"),
        (make.side_table, 0.3, "corner"),
        (make.chest, 0.4, "wall"),
    ],
    "kitchen": [(make.shelf, 0.2, "wall")],
}


def draw_wishes(rng: Random, room: Room) -> list[Wish]:
    """The furniture of a room, the most important first; what depends on its size is drawn here."""
    area, kind = room.area, room.kind
    wishes: list[Wish] = []
    if kind == "bedroom":
        wishes.append((make.double_bed if area > 8.5 else make.single_bed, 1.0, "middle" if area > 10 else "wall"))
    elif kind == "bath":
        wishes.append((make.bath if area > 4.0 and rng.random() < 0.6 else make.shower, 1.0, "corner"))
    elif kind == "kitchen":
        wishes += [(make.counter, 1.0, "corner"), (make.short_counter, 0.7, "corner")]
        if area > 16 and rng.random() < 0.5:
            wishes.append((make.island, 0.8, "centre"))
        elif area > 14:
            wishes.append((make.dining_table, 0.9, "centre"))
        else:
            wishes.append((make.table_for_two, 0.8 if area > 8 else 0.3, "floor"))
    elif kind == "bureau":
        wishes += [(make.desk, 0.9, "wall")] * max(int(area / 7.0), 1)
    elif kind in ("living", "studio"):
        wishes += _wish_for_living(rng, area, kind == "studio" or (area > 30 and rng.random() < 0.3))
    wishes += TABLE["living" if kind == "studio" else kind]
    if kind not in ("wc", "bath"):
        wishes.append((make.stand, 0.5, "corner"))
        wishes += [(make.stand, 0.3, "floor")] * int(area / 12)
    return wishes


def _wish_for_living(rng: Random, area: float, cooking: bool) -> list[Wish]:
    """Somewhere to sit, in large rooms twice; a kitchen where there is none beside."""
    wishes: list[Wish] = [(make.sofa_group, 1.0, "free" if area > 28 and rng.random() < 0.4 else "middle")]
    if cooking:
        wishes.append((make.counter, 1.0, "corner"))
        if area > 32:
            wishes.append((make.island, 0.5, "floor"))
    if cooking or area > 20:
        wishes.append((make.dining_table, 0.85, "floor"))
    for _ in range(int(area / 18)):
        wishes += [(make.shelf, 0.4, "wall"), (make.armchair, 0.4, "floor"), (make.stand, 0.5, "floor")]
    if area > 45:
        wishes += [(make.sofa_group, 0.6, "free"), (make.desk, 0.5, "wall"), (make.chest, 0.5, "wall")]
        wishes += [(make.pillar, 0.4, "floor")] * int(area / 20)
    return wishes
