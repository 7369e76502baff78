"""Networks that know left from right only by a mirror: the mirror image of an observation has the mirror image of its
actions. A robot and its tasks are symmetric; a network that is not learns every step twice, and one side worse."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import torch
from jaxtyping import Float
from torch import Tensor, nn

from vinl.gait.observation import STEPPING_TABLE
from vinl.robot.observation import ObservationTerm

_SWAPPED = (1, 0, 3, 2)
"""The leg on the other side, in the order of ``LEGS``."""

_JOINTS, _POINT = (-1.0, 1.0, 1.0), (1.0, -1.0, 1.0)
"""Signs that the mirror gives to hip, thigh and calf, and to forward, left and up."""

_SIGNS: dict[str, tuple[float, ...]] = {
    "base_linear_velocity": _POINT,
    "base_angular_velocity": (-1.0, 1.0, -1.0),
    "projected_gravity": _POINT,
    "command": (1.0, -1.0, -1.0),
    "joint_position": _JOINTS,
    "joint_velocity": _JOINTS,
    "previous_action": _JOINTS,
    "path_error": _POINT,
    "path_ahead": _POINT,
    "foothold": _POINT[:2],
    "leg_phase": (1.0, 1.0),
    "missed": _POINT[:2],
}
"""Of a term's numbers, or of those of each leg; other terms are (1,)."""


def mirror_terms(terms: Sequence[ObservationTerm]) -> tuple[np.ndarray, np.ndarray]:
    """Where each number of an observation comes from in its mirror image, and its sign there.

    Args:
        terms: of the observation; one with four times its signs has them for each leg.

    Returns:
        (size,) indices and (size,) signs: the mirror image of ``x`` is ``x[indices] * signs``.
    """
    indices: list[int] = []
    signs: list[float] = []
    for term in terms:
        each = _SIGNS.get(term.name, (1.0,))
        first, k = len(indices), len(each)
        legs = _SWAPPED if term.size == 4 * k else (0,)
        indices += [first + k * leg + i for leg in legs for i in range(k)]
        signs += each * len(legs)
        assert len(indices) == first + term.size, term.name
    return np.array(indices), np.array(signs, np.float32)


_ACTION = [term for term in STEPPING_TABLE if term.name == "previous_action"]


class SymmetricMLP(nn.Sequential):
    """Layers from ``STEPPING_TABLE`` to the joints' actions: the mean of what they say and of the mirror image of what
    they say to the mirror image."""

    observation_index: Tensor
    observation_sign: Tensor
    action_index: Tensor
    action_sign: Tensor

    def __init__(self, *layers: nn.Module) -> None:
        super().__init__(*layers)
        for name, terms in (("observation", STEPPING_TABLE.terms), ("action", _ACTION)):
            index, sign = mirror_terms(terms)  # no weights, but on the network's device
            self.register_buffer(f"{name}_index", torch.as_tensor(index, device="cpu"), persistent=False)
            self.register_buffer(f"{name}_sign", torch.as_tensor(sign, device="cpu"), persistent=False)

    def forward(self, input: Float[Tensor, "*n observation"]) -> Float[Tensor, "*n actions"]:
        """Scaled observations to actions."""
        mirrored = input[..., self.observation_index] * self.observation_sign
        plain, other = super().forward(torch.stack([input, mirrored]))
        return (plain + other[..., self.action_index] * self.action_sign) / 2
