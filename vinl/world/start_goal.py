"""Start and goal of an episode."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.spatial import ConvexHull, QhullError

from vinl.config.errors import InputError
from vinl.world.floorplan import ROOM_TO_STAND, FloorPlan
from vinl.world.free_space import FIT_RADIUS, FreeSpace, distance_field, read_field

LEAST_PATH = 1.0
"""A plan without two spots this far apart [m] is refused: the robot would arrive where it starts."""

_MOST = 0.9
"""If less than this fraction of the floor hangs together, the note says so."""

_TRIES = 200


@dataclass(frozen=True, eq=False)
class StartGoal:
    """Where an episode begins, with its heading [rad], and where it should end [m].

    ``geodesic_m`` is the shortest path over the free floor eroded by the robot's footprint [m]; ``note`` says why
    distance or clearance are less than was asked for, or that floor was left out or gaps are narrow, and is empty if
    all is well.
    """

    start: Float[np.ndarray, " 2"]
    yaw: float
    goal: Float[np.ndarray, " 2"]
    geodesic_m: float
    straight_m: float
    note: str = ""


def sample_start_goals(
    plan: FloorPlan, n: int, rng: np.random.Generator, min_distance: float = 5.0, clearance: float = 0.5
) -> list[StartGoal]:
    """Draw n pairs of start and goal, both in one region that the robot really fits through. The same state of the
    generator gives the same pairs.

    The region is the largest that is connected for ``FIT_RADIUS``, so that no path leads only through a gap between
    chairs that the robot would get stuck in. If that region is too small for the distance, but the largest one for the
    navigator's ``FOOTPRINT_RADIUS`` is not, the latter takes its place.

    Pairs are uniform among those whose straight distance is at least ``min_distance`` [m] and that lie at least
    ``clearance`` [m] from walls, furniture and the outside. If no spot of the region has the clearance, 0.4 m (the
    robot can still turn) takes its place; if no two spots are ``min_distance`` apart, 90 % of the region's largest
    distance does. The pair's note tells of all this. Raises ``InputError`` if the plan has no room for the robot to
    stand, or a number asked for is not sensible.
    """
    if n < 0 or not min_distance >= 0 or not clearance >= 0:
        raise InputError("start and goal: number, distance and clearance must not be negative")
    space = FreeSpace(plan)
    spots, notes = _find_spots(plan, FreeSpace(plan, radius=FIT_RADIUS), clearance)
    widest = _measure_extent(spots)
    if widest < min_distance:
        more, more_notes = _find_spots(plan, space, clearance)
        if _measure_extent(more) > max(widest, LEAST_PATH) + plan.frame.resolution:
            gap = 2 * FIT_RADIUS
            spots, notes = more, [*more_notes, f"some paths may lead through gaps narrower than {gap:.2f} m"]
            widest = _measure_extent(spots)
    if widest < min(LEAST_PATH, min_distance):
        raise InputError(
            f"{plan.source}: the plan is too small for the robot: start and goal would be {widest:.1f} m apart; "
            "check its scale (metres per pixel)"
        )
    if widest < min_distance:
        min_distance = 0.9 * widest
        notes.append(f"start and goal are at most {widest:.1f} m apart in this plan")
    pairs = []
    for _ in range(n):
        start, goal = _draw_pair(spots, min_distance, rng)
        yaw = float(rng.uniform(-np.pi, np.pi))
        straight = float(np.linalg.norm(goal - start))
        field = distance_field(space.traversable, plan.frame, goal)
        row, column = plan.frame.cell(start)
        geodesic = max(float(field[row, column]), straight)
        pairs.append(StartGoal(start, yaw, goal, geodesic, straight, "; ".join(notes)))
    return pairs


def measure_route(space: FreeSpace, start: Float[np.ndarray, "2"], goal: Float[np.ndarray, "2"]) -> StartGoal:
    """A start and a goal [m] with their distances, heading 0; the shortest one is infinite where no path leads there.
    Raises ``InputError`` if the goal is not on floor that the robot can reach."""
    straight = float(np.linalg.norm(goal - start))
    return StartGoal(start, 0.0, goal, max(shortest_distance(space, start, goal), straight), straight)


def shortest_distance(space: FreeSpace, start: Float[np.ndarray, "2"], goal: Float[np.ndarray, "2"]) -> float:
    """Length of the shortest path [m]; infinite where there is none. Raises ``InputError`` if the goal is not on floor
    that the robot can reach."""
    frame = space.plan.frame
    return float(read_field(distance_field(space.traversable, frame, goal), frame, start))


def check_way(plan: FloorPlan) -> FloorPlan:
    """The plan, if the robot has a path of ``LEAST_PATH`` to go in it. Raises ``InputError`` if its free floor is in
    pieces, none of which is that long."""
    space = FreeSpace(plan)
    pieces = int(space.regions.max())
    longest = _measure_extent(plan.frame.xy(np.argwhere(space.regions == space.largest)))
    if longest < LEAST_PATH:
        raise InputError(
            f"{plan.source}: a home without a path: the free floor of {plan.area_m2:.1f} m2 is in {pieces} pieces for "
            f"the robot, the largest {longest:.1f} m long; are doors missing, or is the scale wrong?"
        )
    return plan


def _find_spots(plan: FloorPlan, space: FreeSpace, clearance: float) -> tuple[Float[np.ndarray, "m 2"], list[str]]:
    """Where starts and goals may lie in the largest region [m], and what is to be said about it."""
    notes = []
    region = space.regions == space.largest
    cells = np.argwhere(region & (space.clearance >= clearance))
    if len(cells) < 2:
        cells = np.argwhere(region & (space.clearance >= min(ROOM_TO_STAND, clearance)))
        notes.append(f"no clearance of {clearance:.2f} m, {ROOM_TO_STAND:.2f} m instead")
    fraction = region.sum() / space.traversable.sum()
    if fraction < _MOST:
        gap = 2 * space.radius
        notes.append(f"{1 - fraction:.0%} of the floor is left out: no path there is {gap:.2f} m wide")
    return plan.frame.xy(cells), notes


def _draw_pair(spots: np.ndarray, distance: float, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    for _ in range(_TRIES):
        start, goal = spots[rng.integers(len(spots), size=2)]
        if np.linalg.norm(goal - start) >= distance:
            return start, goal
    # such pairs are rare: go through the spots until one has a partner far enough away
    for k in rng.permutation(len(spots)):
        far = np.flatnonzero(np.linalg.norm(spots - spots[k], axis=1) >= distance)
        if len(far):
            return spots[k], spots[rng.choice(far)]
    raise AssertionError("the extent of the spots was measured wrongly")


def _measure_extent(spots: Float[np.ndarray, "m 2"]) -> float:
    """Largest distance between two of the points; 0 for fewer than two."""
    if len(spots) < 2:
        return 0.0
    try:
        corners = spots[ConvexHull(spots).vertices]
    except QhullError:  # all on one line
        corners = spots[[np.lexsort(spots.T)[0], np.lexsort(spots.T)[-1]]]
    return float(np.linalg.norm(corners[:, None] - corners[None], axis=-1).max())
