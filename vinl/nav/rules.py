"""The numbers of a configuration that the kernels read."""

from __future__ import annotations

from typing import Any

import warp as wp

from vinl.nav.config import NavConfig
from vinl.nav.motion_kernels import Rules


def write_rules(config: NavConfig) -> Any:
    """The record of ``motion_kernels.Rules``."""
    robot, episodes, execution, motion, view = (
        config.robot,
        config.episodes,
        config.execution,
        config.motion,
        config.view,
    )
    rules = Rules()
    rules.length, rules.width = robot.length, robot.width
    rules.min_speed, rules.max_speed = robot.min_speed, robot.max_speed
    rules.max_yaw_rate, rules.period = robot.max_yaw_rate, robot.period
    rules.success_radius = episodes.success_radius
    rules.least, rules.most = episodes.distance
    rules.start_speed = wp.vec2(*episodes.start_speed)
    rules.lag = execution.lag
    rules.speed_gain, rules.yaw_gain = wp.vec2(*execution.speed_gain), wp.vec2(*execution.yaw_gain)
    rules.speed_noise, rules.yaw_noise = execution.speed_noise, execution.yaw_noise
    rules.side_slip, rules.yaw_drift = execution.side_slip, execution.yaw_drift
    rules.execution_amplitude = wp.vec2(*execution.amplitude)
    rules.give_way = execution.give_way
    rules.sees_motion = int(config.previous != "action")
    rules.tilt, rules.tilt_offset, rules.tilt_shake = (
        wp.vec2(*motion.tilt),
        wp.vec2(*motion.offset),
        wp.vec2(*motion.shake),
    )
    rules.correlation, rules.amplitude = motion.correlation, wp.vec2(*motion.amplitude)
    rules.tilt_uniform = motion.uniform
    rules.height_offset, rules.height_shake = motion.height_offset, motion.height_shake
    rules.with_trunk = int(motion.with_trunk)
    rules.ceiling_share, rules.ceiling = view.ceiling_share, wp.vec2(*view.ceiling)
    camera = config.camera
    if camera is not None:
        rules.forward, rules.mount_height, rules.pitch_down = camera.forward, camera.mount_height, camera.pitch_down
        rules.tan_half, rules.far = wp.vec2(*camera.record().tan_half), camera.far
    return rules
