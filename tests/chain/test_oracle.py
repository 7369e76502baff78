"""The oracle drives a point that does what it is told."""

from dataclasses import replace

import numpy as np
import pytest

from vinl.chain.choose import load_navigator
from vinl.chain.config import EvaluationConfig
from vinl.chain.episode import draw_routes
from vinl.chain.navigators.base import Task, goal_in_heading_frame
from vinl.chain.navigators.oracle import OracleNavigator, plan_path
from vinl.config.errors import InputError
from vinl.world.boxes import Boxes
from vinl.world.floorplan import FloorPlan
from vinl.world.free_space import FreeSpace
from vinl.world.raster import paint_boxes
from vinl.world.readers import load_floorplan, shipped_floorplans


def drive(plan: FloorPlan, count: int = 6) -> tuple[np.ndarray, float]:
    """Distance to the goal at the end, and the least clearance on the path [m]."""
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
        assert (choice[active, 0] >= 0).all() and (choice[:, 0] <= 1).all()  # who stands at its goal may back up
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
    for xy in ([1.0, 5.0], [8.0, 1.0], [-3.0, -3.0]):  # the last one is outside: it keeps to its old path
        choice = oracle.act({"pose": np.array([[*xy, 0.0]])})
        assert np.isfinite(choice).all()


def test_walks_around_a_gap_that_is_too_narrow(two_rooms: FloorPlan) -> None:
    t, x = 0.1, 4.5
    # a gap of 0.5 m right ahead, and the open floor 4 m away
    rows = np.array([[x, 0.55, 0, t, 1.1, 0, 2.5], [x, 3.1, 0, t, 3.0, 0, 2.5]])
    free = two_rooms.inside & ~paint_boxes(Boxes(rows), two_rooms.frame)
    space = FreeSpace(replace(two_rooms, free=free))
    path = plan_path(space, np.array([3.5, 1.35]), np.array([5.5, 1.35])).points
    assert path[np.abs(path[:, 0] - x).argmin(), 1] > 4.5
    # where there is no other path, it squeezes through
    rows[1] = [x, 3.8, 0, t, 4.4, 0, 2.5]
    space = FreeSpace(replace(two_rooms, free=two_rooms.inside & ~paint_boxes(Boxes(rows), two_rooms.frame)))
    squeeze = plan_path(space, np.array([3.5, 1.35]), np.array([5.5, 1.35]))
    assert squeeze.points[np.abs(squeeze.points[:, 0] - x).argmin(), 1] == pytest.approx(1.35, abs=0.06)
    assert squeeze.ease.min() < 0.1


def test_never_walks_back_and_has_no_recovery(two_rooms: FloorPlan) -> None:
    config = EvaluationConfig()
    route = draw_routes(two_rooms, 1, config)[0]
    oracle = OracleNavigator()
    oracle.reset([Task(FreeSpace(two_rooms), route)])
    pose = np.array([[*route.start, np.arctan2(*(route.goal - route.start)[::-1]) + 1.0]])
    choices = np.array([oracle.act({"pose": pose})[0] for _ in range(20)])
    assert (choices == choices[0]).all() and (choices[:, 0] >= 0).all()
    with pytest.raises(InputError, match="the oracle has none"):
        load_navigator("oracle", config, recovery=True)


def test_unknown_navigator() -> None:
    with pytest.raises(ValueError, match="did you mean 'oracle'"):
        load_navigator("orcale", EvaluationConfig())
