"""The oracle drives a point that does what it is told."""

import numpy as np
import pytest

from vinl.evaluation.config import EvaluationConfig
from vinl.evaluation.episodes import draw_routes
from vinl.evaluation.navigator import Task, load_navigator
from vinl.evaluation.oracle import OracleNavigator
from vinl.evaluation.rollout import goal_in_heading_frame
from vinl.world.floorplan import FloorPlan
from vinl.world.free_space import FreeSpace
from vinl.world.readers import load_floorplan, shipped_floorplans


def drive(plan: FloorPlan, count: int = 6) -> tuple[np.ndarray, float]:
    """Distance to the goal at the end, and the least clearance on the way [m]."""
    config = EvaluationConfig()
    space, routes = FreeSpace(plan), draw_routes(plan, count, config)
    oracle = OracleNavigator(config.oracle)
    oracle.reset([Task(space, route) for route in routes])
    pose = np.array([[*route.start, 1.0] for route in routes])
    goals, clearance = np.stack([route.goal for route in routes]), np.inf
    for _ in range(250):
        away = goal_in_heading_frame(pose, goals)[:, 0]
        active = away > config.success_radius
        choice = oracle.act({"pose": pose})
        assert (choice[:, 0] >= 0).all() and (choice[:, 0] <= 1).all()
        assert (np.abs(choice[:, 1]) <= np.pi / 3 + 1e-9).all()
        for _ in range(25):
            pose[active, 2] += 0.02 * choice[active, 1]
            pose[active, 0] += 0.02 * choice[active, 0] * np.cos(pose[active, 2])
            pose[active, 1] += 0.02 * choice[active, 0] * np.sin(pose[active, 2])
            cell = plan.frame.cell(pose[active, :2])
            clearance = min(clearance, space.clearance[cell[:, 0], cell[:, 1]].min(initial=np.inf))
    return np.linalg.norm(pose[:, :2] - goals, axis=1), float(clearance)


def test_reaches_the_goal_through_a_door(two_rooms: FloorPlan) -> None:
    away, clearance = drive(two_rooms)
    assert (away < 0.4).all()
    assert clearance > 0.25


def test_reaches_the_goal_in_a_shipped_home() -> None:
    away, clearance = drive(load_floorplan(shipped_floorplans()[0]), count=3)
    assert (away < 0.4).all()
    assert clearance > 0.2


def test_plans_anew_when_carried_away(two_rooms: FloorPlan) -> None:
    config = EvaluationConfig()
    space, route = FreeSpace(two_rooms), draw_routes(two_rooms, 1, config)[0]
    oracle = OracleNavigator()
    oracle.reset([Task(space, route)])
    for xy in ([1.0, 5.0], [8.0, 1.0], [-3.0, -3.0]):  # the last one is outside: it keeps to its old way
        choice = oracle.act({"pose": np.array([[*xy, 0.0]])})
        assert np.isfinite(choice).all()


def test_unknown_navigator() -> None:
    with pytest.raises(ValueError, match="did you mean 'oracle'"):
        load_navigator("orcale", EvaluationConfig())
