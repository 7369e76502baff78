"""What has to be known of a policy to run it, as plain data for the file's metadata."""

from __future__ import annotations

import math
from importlib.metadata import version
from typing import Any

from vinl.chain.config import EvaluationConfig
from vinl.chain.controller import ACTION_LIMIT
from vinl.export.frames import TRUNK, explain_rows
from vinl.export.step import DEPTH, NEXT, Step
from vinl.policies.card import PolicyCard
from vinl.policies.depth_policy import DepthPolicy
from vinl.policies.identity import digest_weights
from vinl.policies.policy import LocomotionPolicy
from vinl.robot.aliengo import CONTROL_DT, JOINTS
from vinl.robot.cameras import Camera
from vinl.robot.observation import CLIP

_MISSING = {
    "as_is": "give pixels without a return as the far limit",
    "fill": "give pixels without a return as 0: they are filled from their neighbours",
    "plane": "give pixels without a return as 0: the network is told where they are",
}
"""What a robot's program has to do with pixels without a return, by ``Camera.missing``."""

FORMAT = 1
"""Version of the metadata."""


def describe_step(policy: LocomotionPolicy | DepthPolicy, step: Step) -> dict[str, Any]:
    """Everything that a program needs to run the policy without vinl. Lengths in m, angles in rad, times in s.

    Raises:
        InputError: the card observes something that has no meaning here.
    """
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
        "states": [_describe_state(state.name, state.start.tolist(), list(state.start.shape)) for state in step.states],
        **(_describe_navigation(card) if card.kind == "navigation" else _describe_locomotion(card)),
        **({} if policy.camera is None else _describe_camera(policy.camera)),
    }


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


def _describe_state(name: str, start: Any, shape: list[int]) -> dict[str, Any]:
    """``start`` is one number if all are alike."""
    numbers = set(_flatten(start))
    return {
        "input": name,
        "output": name + NEXT,
        "shape": shape,
        "start": numbers.pop() if len(numbers) == 1 else start,
    }


def _flatten(nested: Any) -> list[float]:
    return [number for part in nested for number in _flatten(part)] if isinstance(nested, list) else [nested]
