"""Robots without dynamics: the trunk glides, the feet are where the gait wants them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vinl.gait.config import GaitConfig
from vinl.gait.footholds import plan_footholds
from vinl.gait.ground_view import FieldView, build_ground_map
from vinl.gait.leg import LONGEST, knee_from_foot
from vinl.gait.path import swing_path
from vinl.gait.state import aim, stance_places, start_gait, swings, tick
from vinl.robot.aliengo import CONTROL_DT, FOOT_RADIUS, HIPS, THIGH_ASIDE
from vinl.world.boxes import Boxes
from vinl.world.grid import BLOCK, GridFrame, flat_field, raise_boxes

_SHANK_RADIUS = 0.0145


class Glide(NamedTuple):
    """(n,) what each robot touched on its way over the bar, and whether its legs were long enough for it."""

    foot: np.ndarray
    shank: np.ndarray
    in_reach: np.ndarray


def glide(config: GaitConfig, height: float, speed: float, robots: int, depth: float = 0.2) -> Glide:
    """Robots that start half a stride and more apart glide over a bar across their path."""
    n, z = robots, config.hip_height
    frame = GridFrame(-4.0, -1.0, 0.05, (41, 181))
    bar, field = Boxes(np.array([[0.0, 0.0, 0.0, depth, 2.0, 0.0, height]])), flat_field(frame)
    raise_boxes(field, bar, BLOCK)
    ground = build_ground_map(field.heights, frame, bar)
    qpos, command = np.zeros((n, 7)), np.zeros((n, 3))
    qpos[:, 0], qpos[:, 2], qpos[:, 3] = -2.2 - np.linspace(0, 0.6, n), z, 1.0
    command[:, 0] = speed
    velocity, motion = command[:, :2].copy(), np.zeros((n, 4))
    motion[:, 0] = speed * CONTROL_DT
    places = np.broadcast_to(stance_places(config), (n, 4, 2))
    feet = np.concatenate([places, np.full((n, 4, 1), FOOT_RADIUS - z)], -1).astype(float)
    gait = start_gait(np, config, feet)
    foot, shank, in_reach = np.zeros(n, bool), np.zeros(n, bool), np.ones(n, bool)
    for _ in range(round(4.0 / speed / CONTROL_DT)):
        qpos[:, :3] += motion[:, :3]
        feet -= motion[:, None, :3]
        gait = tick(np, config, gait, motion, command, feet)
        view = FieldView(np, ground, frame, qpos)
        gait = aim(
            np, config, gait, plan_footholds(np, config, view, gait, velocity, command, feet), velocity, command, feet
        )
        feet = swing_path(np, config, gait, feet)
        motion[:, 2] = gait.hip - qpos[:, 2]
        feet[..., 2] = np.where(swings(np, config, gait), feet[..., 2], FOOT_RADIUS - qpos[:, 2:3])
        ahead = feet[..., 0] - HIPS[:, 0]
        near = np.abs(qpos[:, 0]) < 1.1
        aside = feet[..., 1] - (HIPS[:, 1] + THIGH_ASIDE)
        long = np.hypot(aside, feet[..., 2])  # the leg lies in a plane that leans by as much
        in_reach &= ~near | (np.hypot(ahead, long) < LONGEST).all(1)
        foot |= (view.clearance(feet) < FOOT_RADIUS - 0.002).any(1)
        back, up = knee_from_foot(np, ahead, long)
        across, up = -aside * up / long, -feet[..., 2] * up / long
        line = np.linspace(0.1, 1.0, 8)[:, None, None]
        points = np.stack([feet[..., k] + line * part for k, part in enumerate((back, across, up))], -1)
        shank |= (view.clearance(np.moveaxis(points, 0, 2)) < _SHANK_RADIUS).any((1, 2))
    return Glide(foot, shank, in_reach)
