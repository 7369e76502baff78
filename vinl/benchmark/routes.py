"""Start/goal pairs of one's own: read from a file, and placed in a floor plan."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from vinl.config.errors import InputError
from vinl.config.loader import closest, read_yaml
from vinl.world.floorplan import FloorPlan
from vinl.world.free_space import FreeSpace
from vinl.world.start_goal import StartGoal, measure_route


def read_routes(path: Path, plans: Sequence[FloorPlan]) -> dict[str, list[StartGoal]]:
    """The start/goal pairs of a YAML file, checked against the floor plans.

    The file has a list for each plan, all of the same length: ``harbour_flat: [{start: [1.0, 2.0], goal: [6.5, 2.0]}]``
    [m].

    Raises:
        InputError: the file is broken, a plan has no pairs, or a pair cannot be walked.
    """
    data, names = read_yaml(path), [plan.name for plan in plans]
    for name in data:
        if name not in names:
            raise InputError(f"{path}: {name!r} is none of the floor plans{closest(name, names)}: {', '.join(names)}")
    routes = {}
    for plan in plans:
        rows = data.get(plan.name)
        if not isinstance(rows, list) or not rows:
            raise InputError(f"{path}: {plan.name} needs a list of pairs, each {{start: [x, y], goal: [x, y]}}")
        space = FreeSpace(plan)
        routes[plan.name] = [
            place_route(space, *_read_pair(row, f"{path}, {plan.name}, pair {k}"), f"{path}, {plan.name}, pair {k}")
            for k, row in enumerate(rows)
        ]
    counts = {name: len(pairs) for name, pairs in routes.items()}
    if len(set(counts.values())) > 1:
        raise InputError(f"{path}: every plan needs the same number of pairs, got {counts}")
    return routes


def place_route(
    space: FreeSpace, start: Float[np.ndarray, "2"], goal: Float[np.ndarray, "2"], source: str = "route"
) -> StartGoal:
    """A start/goal pair in a floor plan, with its distances.

    Args:
        start, goal: x, y [m].
        source: names the pair in errors.

    Raises:
        InputError: one of the two is no place where the robot can be, or no path leads from one to the other.
    """
    for name, point in (("start", start), ("goal", goal)):
        why = explain_place(space, point)
        if why:
            raise InputError(f"{source}: {name} ({point[0]:.2f}, {point[1]:.2f}) {why}")
    route = measure_route(space, start, goal)
    if not np.isfinite(route.geodesic_m):
        raise InputError(
            f"{source}: no path leads from ({start[0]:.2f}, {start[1]:.2f}) to ({goal[0]:.2f}, {goal[1]:.2f}): they "
            f"lie in rooms without a passage of {2 * space.radius:.2f} m between them"
        )
    return route


def explain_place(space: FreeSpace, point: Float[np.ndarray, "2"]) -> str:
    """Why the robot cannot be at a point [m]; empty if it can."""
    plan = space.plan
    xs, ys = plan.frame.centres()
    if not (xs[0] <= point[0] <= xs[-1] and ys[0] <= point[1] <= ys[-1]):  # neither does NaN
        return "lies outside the floor plan"
    row, column = plan.frame.cell(point)
    if space.traversable[row, column]:
        return ""
    for name, boxes in (("a wall", plan.walls), ("furniture", plan.furniture)):
        if len(boxes) and boxes.contain(point[None]).any():
            return f"lies inside {name}"
    if not plan.inside[row, column]:
        return "lies outside the building"
    away = float(space.clearance[row, column])
    return f"is {away:.2f} m from a wall or furniture, the robot needs {space.radius:.2f} m"


def describe_routes(routes: Mapping[str, Sequence[StartGoal]]) -> dict[str, Any]:
    """Starts and goals as plain data."""
    return {
        name: [[*(float(v) for v in pair.start), *(float(v) for v in pair.goal)] for pair in pairs]
        for name, pairs in routes.items()
    }


def _read_pair(row: Any, source: str) -> tuple[np.ndarray, np.ndarray]:
    points = []
    for name in ("start", "goal"):
        point = row.get(name) if isinstance(row, dict) and set(row) == {"start", "goal"} else None
        if not isinstance(point, list) or len(point) != 2 or not all(type(v) in (int, float) for v in point):
            raise InputError(f"{source}: needs {{start: [x, y], goal: [x, y]}} in metres, got {row!r}")
        points.append(np.array(point, np.float64))
    return points[0], points[1]
