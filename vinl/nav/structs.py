"""What the kernels share beside the homes: the state of all robots, and the numbers of the configuration."""

# pyright: reportInvalidTypeForm=false, reportAttributeAccessIssue=false

from typing import Any, no_type_check

import warp as wp

from vinl.nav.config import NavConfig
from vinl.sensing.structs import fill_struct
from vinl.sensing.warp_start import start_warp

start_warp()
wp.set_module_options({"enable_backward": False})


@wp.struct
@no_type_check
class Robots:
    """The state of all robots."""

    home: wp.array(dtype=wp.int32)
    goal: wp.array(dtype=wp.int32)
    position: wp.array(dtype=wp.vec2)
    yaw: wp.array(dtype=wp.float32)
    speed: wp.array(dtype=wp.float32)
    yaw_rate: wp.array(dtype=wp.float32)
    twist: wp.array(dtype=wp.vec3)  # forward, sideways [m/s] and yaw rate [rad/s] of the last step as it was made
    distance: wp.array(dtype=wp.float32)
    gain: wp.array(dtype=wp.vec4)  # of forward speed and yaw rate, yaw drift [rad/s], and factor on the noises
    mount: wp.array(dtype=wp.vec4)  # roll, pitch, height of this episode's camera, height of the ceiling (0: none)
    amplitude: wp.array(dtype=wp.float32)  # of this episode's sway
    sway: wp.array(dtype=wp.vec3)  # roll, pitch and height within the episode, each of variance 1
    previous: wp.array(dtype=wp.vec2)  # what the robot knows of its last step


@wp.struct
@no_type_check
class Rules:
    """Numbers of the configuration."""

    length: wp.float32
    width: wp.float32
    min_speed: wp.float32
    max_speed: wp.float32
    max_yaw_rate: wp.float32
    period: wp.float32
    success_radius: wp.float32
    least: wp.float32  # distance at the start
    most: wp.float32
    start_speed: wp.vec2
    lag: wp.float32
    speed_gain: wp.vec2
    yaw_gain: wp.vec2
    speed_noise: wp.float32
    yaw_noise: wp.float32
    side_slip: wp.float32
    yaw_drift: wp.float32
    execution_amplitude: wp.vec2
    give_way: wp.float32
    sees_motion: wp.int32
    tilt: wp.vec2
    tilt_offset: wp.vec2
    tilt_shake: wp.vec2
    correlation: wp.float32
    amplitude: wp.vec2
    tilt_uniform: wp.float32
    height_offset: wp.float32
    height_shake: wp.float32
    with_trunk: wp.int32
    forward: wp.float32
    mount_height: wp.float32
    pitch_down: wp.float32
    tan_half: wp.vec2
    far: wp.float32
    ceiling_share: wp.float32
    ceiling: wp.vec2


def write_rules(config: NavConfig) -> Any:
    """The record of ``Rules``."""
    motion, execution, episodes, camera = config.motion, config.execution, config.episodes, config.camera
    values = vars(config.robot) | vars(execution) | vars(motion) | vars(config.view)
    values |= {
        "success_radius": episodes.success_radius,
        "least": episodes.distance[0],
        "most": episodes.distance[1],
        "start_speed": episodes.start_speed,
        "execution_amplitude": execution.amplitude,
        "sees_motion": int(config.previous != "action"),
        "tilt_offset": motion.offset,
        "tilt_shake": motion.shake,
        "tilt_uniform": motion.uniform,
        "with_trunk": int(motion.with_trunk),
    }
    if camera is not None:
        view = {name: getattr(camera, name) for name in ("forward", "mount_height", "pitch_down", "far")}
        values |= view | {"tan_half": camera.record().tan_half}
    return fill_struct(Rules, values)
