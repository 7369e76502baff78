"""Networks that know left from right only by a mirror: the mirror image of an observation has the mirror image of its
actions. A robot and its tasks are symmetric; a network that is not learns every step twice, and one side worse."""

from __future__ import annotations

import numpy as np
import torch
from jaxtyping import Float
from torch import Tensor, nn

from vinl.gait.observation import STEPPING_TABLE

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


def mirror_terms(names: tuple[str, ...], sizes: tuple[int, ...]) -> tuple[np.ndarray, np.ndarray]:
    """Where each number of an observation comes from in its mirror image, and its sign there.

    Args:
        names, sizes: of the terms; one with four times its signs has them for each leg.

    Returns:
        (size,) indices and (size,) signs: the mirror image of ``x`` is ``x[indices] * signs``.
    """
    indices: list[int] = []
    signs: list[float] = []
    for name, size in zip(names, sizes, strict=True):
        each = _SIGNS.get(name, (1.0,))
        first, k = len(indices), len(each)
        legs = _SWAPPED if size == 4 * k else (0,)
        indices += [first + k * leg + i for leg in legs for i in range(k)]
        signs += each * len(legs)
        assert len(indices) == first + size, name
    return np.array(indices), np.array(signs, np.float32)


class SymmetricMLP(nn.Sequential):
    """Layers from ``STEPPING_TABLE`` to the joints' actions: the mean of what they say and of the mirror image of what
    they say to the mirror image."""

    seen: Tensor
    seen_sign: Tensor
    done: Tensor
    done_sign: Tensor

    def __init__(self, *layers: nn.Module) -> None:
        super().__init__(*layers)
        terms = STEPPING_TABLE.terms
        seen = mirror_terms(tuple(t.name for t in terms), tuple(t.size for t in terms))
        done = mirror_terms(("previous_action",), (12,))
        numbers = ("seen", seen[0]), ("seen_sign", seen[1]), ("done", done[0]), ("done_sign", done[1])
        for name, values in numbers:  # no weights, but on the network's device
            self.register_buffer(name, torch.as_tensor(values, device="cpu"), persistent=False)

    def forward(self, input: Float[Tensor, "*n observation"]) -> Float[Tensor, "*n actions"]:
        """Scaled observations to actions."""
        mirrored = input[..., self.seen] * self.seen_sign
        plain, other = super().forward(torch.stack([input, mirrored]))
        return (plain + other[..., self.done] * self.done_sign) / 2
