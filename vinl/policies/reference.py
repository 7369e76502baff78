"""The motion that a gait asks for, as actions: what a locomotion policy of planned footholds adds its own to.

Legs in the air go where their paths lead, legs on the ground push the trunk along, upright, at the height that
footholds are chosen for, and carry its weight. Nothing in it is learned. By itself it walks a few metres and falls;
what it lacks, balance above all, is what a policy learns. Everything follows from the policy's own observation.
"""

from __future__ import annotations

import torch
from jaxtyping import Float
from torch import Tensor, nn

from vinl.gait.config import GaitConfig
from vinl.gait.leg import leg_angles, leg_jacobian
from vinl.gait.observation import STEPPING_TABLE
from vinl.gait.path import LOOK_AHEAD
from vinl.gait.proprioception import feet_in_trunk, heading_axes, into_heading_frame
from vinl.robot.aliengo import ACTION_SCALE, DEFAULT_POSE, FOOT_RADIUS, GRAVITY, KD, KP, MASS

_UPRIGHT = 0.1
"""Legs that stand take back the whole tilt, and what it grows in this time [s]."""

_PUSH, _TURN = 0.2, 0.35
"""They move the trunk by what it misses of its velocity in so much time [s], along and in turning."""

_CATCH_UP = 0.5
"""And by this fraction of the way by which it has fallen behind."""

_LEAD = 2 * KD / KP
"""Dampers hold legs back that move: they are commanded so much ahead [s], twice what dampers alone would ask for."""

_SOFT = 1e-3
"""Where feet that stand cannot carry the weight without a moment (two on a line), they come this near [m^2]."""


class GaitReference(nn.Module):
    """Actions of n robots that would make them follow their gaits; holds no weights.

    Args:
        config: of the gait that is observed.
    """

    scale: Tensor
    pose: Tensor

    def __init__(self, config: GaitConfig) -> None:
        super().__init__()
        self._hip = config.hip_height
        self._places = {term.name: STEPPING_TABLE.place(term.name) for term in STEPPING_TABLE}
        self.register_buffer("scale", torch.from_numpy(STEPPING_TABLE.scale), persistent=False)
        self.register_buffer("pose", torch.tensor(DEFAULT_POSE, dtype=torch.float32, device="cpu"), persistent=False)

    def forward(self, observation: Float[Tensor, "n observation"]) -> Float[Tensor, "n 12"]:
        """Scaled observations in the order of ``gait.observation.STEPPING_TABLE`` to actions."""
        n = len(observation)
        felt = observation[:, : len(self.scale)] / self.scale

        def row(name: str) -> Tensor:
            return felt[:, self._places[name]]

        command, gravity = row("command"), row("projected_gravity")
        joints = row("joint_position") + self.pose
        axes = heading_axes(torch, gravity)
        in_trunk = feet_in_trunk(torch, joints)
        feet = into_heading_frame(axes, in_trunk)
        velocity, turning = (
            into_heading_frame(axes, row(name)) for name in ("base_linear_velocity", "base_angular_velocity")
        )
        roll, pitch = torch.atan2(-gravity[:, 1], -gravity[:, 2]), torch.atan2(gravity[:, 0], -gravity[:, 2])
        stands, loaded = row("swing") < 0.5, row("swing_ahead") < 0.5

        # in the air: where the path is when the leg gets there, seen from where the trunk is then
        late = LOOK_AHEAD
        path = feet + row("path_ahead").reshape(n, 4, 3)
        level = torch.cat([velocity[:, :2], torch.zeros_like(velocity[:, 2:])], 1)
        path = _turned(path - late * level[:, None], -late * turning[:, 2])
        path = _in_trunk(path, roll + 0.5 * late * turning[:, 0], pitch + 0.5 * late * turning[:, 1])

        # on the ground: where the foot would be under a trunk that moves as it should
        standing = stands.float()
        floor = (standing * feet[..., 2]).sum(1) / standing.sum(1).clip(min=1.0) - FOOT_RADIUS
        lack = self._hip + row("hip")[:, 0] + floor
        shift = _LEAD * command[:, :2] + _PUSH * (command[:, :2] - velocity[:, :2]) + _CATCH_UP * row("missed")
        under = torch.cat([feet[..., :2] - shift[:, None], feet[..., 2:] - lack[:, None, None]], -1)
        under = _turned(under, -_TURN * (command[:, 2] - turning[:, 2]))
        under = _in_trunk(under, -_UPRIGHT * turning[:, 0], -_UPRIGHT * turning[:, 1])  # of a trunk that is upright

        moves = (~(stands & loaded))[..., None]
        target = leg_angles(torch, torch.where(moves, path, under))
        # in double: with the weight on few feet it cancels, and an exported policy would differ by 1e-4
        push = carry_weight(feet.double(), row("load_ahead").double()).to(feet.dtype)
        up = -gravity / gravity.norm(dim=1, keepdim=True).clip(min=1e-6)
        force = push[..., None] * up[:, None]  # of the ground on each foot, in the trunk's frame
        torque = -(leg_jacobian(torch, joints) * force[..., None]).sum(-2)
        return (target + torque.reshape(n, 12) / KP - self.pose) / ACTION_SCALE


def carry_weight(feet: Float[Tensor, "n 4 3"], loaded: Float[Tensor, "n 4"]) -> Float[Tensor, "n 4"]:
    """How much each foot carries [N], so that the weight turns the trunk as little as it can.

    Args:
        feet: in the heading frame [m].
        loaded: 1 for feet that stand, 0 for others.
    """
    x, y = feet[..., 0] * loaded, feet[..., 1] * loaded
    # A A^T of the three equations (sum of forces, moments about y and x), and its inverse's first column
    n, sx, sy = loaded.sum(1) + _SOFT, x.sum(1), y.sum(1)
    xx, yy, xy = (x * x).sum(1) + _SOFT, (y * y).sum(1) + _SOFT, (x * y).sum(1)
    a, b, c = xx * yy - xy * xy, xy * sy - sx * yy, sx * xy - xx * sy
    scale = MASS * GRAVITY / (n * a + sx * b + sy * c)
    share = (a * scale)[:, None] * loaded + (b * scale)[:, None] * x + (c * scale)[:, None] * y
    return share.clip(0.0, MASS * GRAVITY)


def _turned(points: Float[Tensor, "n 4 3"], angle: Float[Tensor, " n"]) -> Float[Tensor, "n 4 3"]:
    """Turned by small angles about the vertical [rad]."""
    a = angle[:, None]
    return torch.stack([points[..., 0] - a * points[..., 1], points[..., 1] + a * points[..., 0], points[..., 2]], -1)


def _in_trunk(points: Float[Tensor, "n 4 3"], roll: Float[Tensor, " n"], pitch: Float[Tensor, " n"]) -> Tensor:
    """Points of the heading frame in the frame of a trunk with a roll and a pitch [rad]."""
    x, y, z = points.unbind(-1)
    (cr, sr), (cp, sp) = ((torch.cos(a)[:, None], torch.sin(a)[:, None]) for a in (roll, pitch))
    ahead, up = cp * x - sp * z, sp * x + cp * z
    return torch.stack([ahead, cr * y + sr * up, cr * up - sr * y], -1)
