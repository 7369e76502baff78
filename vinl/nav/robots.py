"""The state of all robots on the device: as a record that kernels write, and as the same memory in torch."""

# pyright: reportInvalidTypeForm=false, reportAttributeAccessIssue=false

from typing import Any, no_type_check

import torch
import warp as wp

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


_STATE = {
    "home": (torch.int32, (), None),
    "goal": (torch.int32, (), None),
    "position": (torch.float32, (2,), wp.vec2),
    "yaw": (torch.float32, (), None),
    "speed": (torch.float32, (), None),
    "yaw_rate": (torch.float32, (), None),
    "twist": (torch.float32, (3,), wp.vec3),
    "distance": (torch.float32, (), None),
    "gain": (torch.float32, (4,), wp.vec4),
    "mount": (torch.float32, (4,), wp.vec4),
    "amplitude": (torch.float32, (), None),
    "sway": (torch.float32, (3,), wp.vec3),
    "previous": (torch.float32, (2,), wp.vec2),
}
"""Type and shape of each entry of ``Robots`` for one robot, and what a row of it is to Warp."""


def make_robots(count: int, device: torch.device) -> tuple[dict[str, torch.Tensor], Any]:
    """Robots whose state is zero.

    Args:
        count: how many.
        device: where they are.

    Returns:
        Tensors (count, ...) by the names of ``Robots``, and the record itself, which shares their memory.
    """
    state = {name: torch.zeros(count, *shape, dtype=dtype, device=device) for name, (dtype, shape, _) in _STATE.items()}
    robots = Robots()
    for name, (_, _, vector) in _STATE.items():
        setattr(robots, name, wp.from_torch(state[name], dtype=vector))
    return state, robots
