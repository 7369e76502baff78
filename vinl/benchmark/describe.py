"""Which navigator and which floor plan an evaluation was made with, as plain data."""

from __future__ import annotations

import hashlib
from typing import Any

import numpy as np

from vinl.chain.navigators.base import ORACLE, Navigator
from vinl.chain.navigators.learned import LearnedNavigator
from vinl.chain.navigators.oracle import OracleNavigator
from vinl.chain.navigators.recovery import RecoveringNavigator
from vinl.policies.identity import describe_policy
from vinl.world.floorplan import FloorPlan


def describe_navigator(navigator: Navigator) -> dict[str, Any]:
    """Which navigator it was: the policy, or the name alone."""
    if isinstance(navigator, RecoveringNavigator):
        return {**describe_navigator(navigator.inner), "recovery": True}
    if isinstance(navigator, LearnedNavigator):
        return describe_policy(navigator.policy)
    if isinstance(navigator, OracleNavigator):
        return {"name": ORACLE}
    return {"name": getattr(navigator, "name", type(navigator).__name__)}


def describe_plan(plan: FloorPlan) -> dict[str, Any]:
    """Which floor plan it was: walls, furniture and the inside, not where its file lay."""
    digest = hashlib.sha256()
    for rows in (plan.walls.rows, plan.furniture.rows):
        digest.update(np.ascontiguousarray(rows, np.float64).tobytes() + b"|")
    frame = plan.frame
    digest.update(repr((frame.x0, frame.y0, frame.resolution, frame.shape)).encode())
    digest.update(np.packbits(plan.inside).tobytes())
    return {"name": plan.name, "source": plan.source, "sha256": digest.hexdigest()}
