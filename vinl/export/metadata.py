"""What has to be known of a policy to run it, as plain data for the file's metadata."""

from __future__ import annotations

import json
import math
from importlib.metadata import version
from typing import Any

from vinl.chain.config import EvaluationConfig
from vinl.chain.controller import ACTION_LIMIT
from vinl.config.errors import InputError
from vinl.config.loader import closest
from vinl.export.step import AGE, DEPTH, NEXT, StateInput, Step
from vinl.gait.path import LOAD_AHEAD, LOOK_AHEAD
from vinl.policies.card import PolicyCard
from vinl.policies.depth_policy import DepthPolicy
from vinl.policies.identity import digest_weights
from vinl.policies.policy import LocomotionPolicy
from vinl.robot.aliengo import CONTROL_DT, JOINTS
from vinl.robot.cameras import Camera
from vinl.robot.observation import CLIP

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
    "path_error": f"from each foot to the next point of its path; of the gait, as vinl.gait plans it; {HEADING}",
    "path_ahead": f"from each foot to where its path is {LOOK_AHEAD:g} s later; {HEADING}",
    "foothold": f"from each foot to where it comes down next, forward and left; {HEADING}",
    "apex": "from a swinging foot up to the highest point of its path",
    "leg_phase": "sine and cosine of each leg's phase",
    "swing": "1 for each foot that swings by the clock",
    "swing_ahead": f"the same, {LOOK_AHEAD:g} s later",
    "load_ahead": f"1 for each foot that stands by the clock {LOAD_AHEAD:g} s later",
    "rate": "how fast the clock of each leg runs while it stands, less 1",
    "hip": "how far the hips should rise above their usual height",
    "missed": f"how far the trunk has fallen behind its commands, forward and left; {HEADING}",
    "goal_distance": "straight horizontal distance from the trunk's origin to the goal, from odometry",
    "goal_direction": f"cosine and sine of the goal's bearing, left positive; {HEADING}",
    "previous_motion": "what the robot did since the last decision, as the action that asks for it: mean forward speed "
    "and yaw rate along the arc between both poses in units of the action's ranges, held to [-1, 1]; zeros when an "
    "episode begins",
    "previous_step": "how far the robot came since the last decision, by odometry: forward, left and turned, in the "
    "heading frame of the last decision; zeros when an episode begins",
}
"""Row of an observation table to what it is."""


def explain_rows(table: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """The rows of a card's table with ``meaning``, frame included; a row that brings its own keeps it. Raises
    ``InputError`` if a row is unknown and brings none."""
    explained = []
    for row in table:
        name = row["name"]
        if "meaning" not in row and name not in MEANINGS:
            near = closest(name, list(MEANINGS))
            raise InputError(f"export does not know what the observation {name!r} means{near}; give its row a meaning")
        explained.append({"meaning": MEANINGS.get(name), **row})
    return explained


_MISSING = {
    "as_is": "give pixels without a return as the far limit",
    "fill": "give pixels without a return as 0: neighbours fill them, and what is beyond the far limit",
    "plane": "give pixels without a return as 0: the network is told where they are",
}
"""What a robot's program has to do with pixels without a return, by ``Camera.missing``."""

_AGE = "time since the image was taken, by its time stamp, up to 0.14; 0 if it is not known"

FORMAT = 1
"""Version of the metadata."""


def describe_step(policy: LocomotionPolicy | DepthPolicy, step: Step) -> dict[str, Any]:
    """Everything that a program needs to run the policy without vinl. Lengths in m, angles in rad, times in s. Raises
    ``InputError`` if the card observes something that has no meaning here."""
    card = policy.card
    return {
        "format": FORMAT,
        "vinl_version": version("vinl"),
        "kind": card.kind,
        "name": card.name,
        "weights_sha256": digest_weights(policy.network),
        "commit": card.commit,
        "samples": card.samples,
        "robot": "Unitree AlienGo",
        "observation": explain_rows(card.observation),
        "states": [_describe_state(state) for state in step.states],
        **(_describe_navigation(card) if card.kind == "navigation" else _describe_locomotion(card)),
        **({} if policy.camera is None else _describe_camera(policy.camera)),
        **({"image_age": {"input": AGE, "unit": "s", "meaning": _AGE}} if step.dates_images else {}),
    }


def read_metadata(properties: dict[str, str]) -> dict[str, Any]:
    """The metadata as it was, from what a runtime or ``onnx`` reads from the file."""
    return {key: json.loads(value) for key, value in properties.items()}


def _describe_locomotion(card: PolicyCard) -> dict[str, Any]:
    """The observation is scaled, then held to ``observation_clip``; the action is held to ``action_clip``, then joint
    target = default pose + scale x action."""
    return {
        "period": CONTROL_DT,
        "observation_clip": CLIP,
        "joint_names": list(JOINTS),
        "default_pose": list(card.action["default_pose"]),
        "action_scale": card.action["scale"],
        "action_clip": ACTION_LIMIT,
        "kp": card.action["kp"],
        "kd": card.action["kd"],
    }


def _describe_navigation(card: PolicyCard) -> dict[str, Any]:
    """The action is held to [-1, 1], then spans the ranges."""
    rules = EvaluationConfig()
    return {
        "period": rules.navigation_period * CONTROL_DT,
        "action_clip": 1.0,
        "forward_speed": list(card.action["forward_speed"]),
        "yaw_rate": list(card.action["yaw_rate"]),
        "success_radius": rules.success_radius,
    }


def _describe_camera(camera: Camera) -> dict[str, Any]:
    pose = {"frame": TRUNK, "rotation": camera.rotation().tolist(), "rotation_columns": "forward, left, up"}
    return {
        "camera": camera.describe() | {"vfov": 2 * math.atan(camera.tan_half[1])} | pose,
        "image_preparation": {
            "input": DEPTH,
            "unit": "m along the optical axis, not along the ray",
            "layout": "row 0 is the top, column 0 the left of the image; square pixels, no distortion",
            "far": "nothing hit, or farther than the camera's far limit: that limit or more",
            "missing": _MISSING[camera.missing],
            "done_by_the_file": "divided by the far limit, held to [0, 1], missing pixels as said",
        },
    }


def _describe_state(state: StateInput) -> dict[str, Any]:
    """``start`` is one number if all are alike."""
    start, first = state.start, state.start.flatten()[0]
    return {
        "input": state.name,
        "output": state.name + NEXT,
        "shape": list(start.shape),
        "start": first.item() if (start == first).all() else start.tolist(),
    }
