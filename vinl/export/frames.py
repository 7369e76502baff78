"""In which frame each number is that a policy observes: what the observation table alone does not say."""

from __future__ import annotations

from typing import Any

from vinl.config.errors import InputError
from vinl.config.fields import closest
from vinl.robot.observation import SCAN_OFFSET, SCAN_POINTS

TRUNK = "trunk frame: origin in the middle of the trunk, x forward, y left, z up, fixed to the trunk"
HEADING = "heading frame: origin below the middle of the trunk, x along its heading, y left, z up, level"

MEANINGS = {
    "base_linear_velocity": f"velocity of the trunk's origin over the ground; {TRUNK}",
    "base_angular_velocity": f"angular velocity of the trunk, as a gyroscope reads it; {TRUNK}",
    "projected_gravity": f"unit vector that points down, (0, 0, -1) when level; {TRUNK}",
    "command": f"commanded forward speed, speed to the left, yaw rate; {HEADING}",
    "joint_position": "joint angles minus default_pose, in the order of joint_names",
    "joint_velocity": "joint speeds, in the order of joint_names",
    "previous_action": "the last output of the policy, a navigation policy's held to [-1, 1]; zeros when an episode "
    "begins",
    "height_scan": f"height of the trunk's origin - {SCAN_OFFSET} m - height of the ground at points_m, held to +-1 m; "
    f"{HEADING}",
    "goal_distance": "straight horizontal distance from the trunk's origin to the goal, from odometry",
    "goal_direction": f"cosine and sine of the goal's bearing, left positive; {HEADING}",
    "previous_motion": "what the robot did since the last decision, as the action that asks for it: mean forward speed "
    "and yaw rate along the arc between both poses in units of the action's ranges, held to [-1, 1]; zeros when an "
    "episode begins",
}
"""Row of an observation table to what it is."""


def explain_rows(table: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """The rows of a card's table with ``meaning``, frame included, and the points of a height scan.

    A row that brings its own ``meaning`` keeps it.

    Raises:
        InputError: a row is unknown and brings no meaning.
    """
    explained = []
    for row in table:
        name = row["name"]
        if "meaning" not in row and name not in MEANINGS:
            near = closest(name, list(MEANINGS))
            raise InputError(f"export does not know what the observation {name!r} means{near}; give its row a meaning")
        more = {"points_m": SCAN_POINTS.tolist()} if name == "height_scan" else {}
        explained.append({"meaning": MEANINGS.get(name), **row, **more})
    return explained
