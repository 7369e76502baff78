"""From the depth that a camera gives to the image that a network takes: normalised, and pixels without a return dealt
with as the policy was trained for. Plain array operations, so that an exported policy can carry them along."""

from __future__ import annotations

import torch
from jaxtyping import Bool, Float
from torch import Tensor

from vinl.robot.cameras import Camera

MARK = -1.0
"""A pixel without a return in an image whose network has a second plane for them."""


def prepare_depth(camera: Camera, depth: Float[Tensor, "*n height width"]) -> Float[Tensor, "*n height width"]:
    """The image that a policy with this camera takes, as a fraction of the far limit, in [0, 1]. ``camera.missing``
    says what becomes of pixels without a return, which are 0, less, or no number; if it is ``"plane"`` they are
    ``MARK``."""
    return settle_missing(camera.missing, camera.normalise(depth), ~(depth > 0))


def settle_missing(
    missing: str, image: Float[Tensor, "*n height width"], lost: Bool[Tensor, "*n height width"]
) -> Float[Tensor, "*n height width"]:
    """A normalised image whose lost pixels are left as they are (``"as_is"``), filled (``"fill"``) or marked
    (``"plane"``). To be filled is also what lies beyond the far limit: a real camera has no return from there."""
    if missing == "fill":
        return fill_missing(image, lost | (image >= 1))
    if missing == "plane":
        return torch.where(lost, MARK, image)
    return image


def fill_missing(
    image: Float[Tensor, "*n height width"], lost: Bool[Tensor, "*n height width"]
) -> Float[Tensor, "*n height width"]:
    """Lost pixels read as the nearest one of their row that returned, of two as near the one with less depth; rows
    without any as the nearest row that has some, of two as near the lower; an image without any as 0, as if at a wall.

    Along a row, because a level camera sees floor and ceiling at one depth there, and because what hides from one of
    two imagers lies beside an edge.
    """
    width = image.shape[-1]
    column = torch.arange(width, device=image.device, dtype=image.dtype)  # half precision counts to 2048
    left = _carry(torch.where(lost, -torch.inf, column), 1)
    right = -_carry(torch.where(lost, -torch.inf, -column), -1)
    known = torch.isfinite(left) | torch.isfinite(right)
    before, after = (torch.gather(image, -1, at.clamp(0, width - 1).long()) for at in (left, right))
    away, ahead = column - left, right - column
    filled = torch.where(away < ahead, before, torch.where(away > ahead, after, torch.minimum(before, after)))
    return _fill_rows(filled, known.any(-1))


def _fill_rows(image: Tensor, known: Tensor) -> Tensor:
    """Rows that are not known read as the nearest one that is, of two as near the lower one, or 0."""
    height = image.shape[-2]
    row = torch.arange(height, device=image.device, dtype=image.dtype)
    above = _carry(torch.where(known, row, -torch.inf), 1)
    below = -_carry(torch.where(known, -row, -torch.inf), -1)
    source = torch.where(row - above < below - row, above, below)
    filled = torch.gather(image, -2, source.clamp(0, height - 1).long()[..., None].expand(image.shape))
    return torch.where(torch.isfinite(source)[..., None], filled, 0.0).to(image.dtype)


def _carry(values: Tensor, side: int) -> Tensor:
    """The largest value so far along the last dimension, from its begin (``side`` 1) or its end (-1). In log2(length)
    rounds: after each, a value reaches twice as far. An exported policy can hold this, a running maximum not."""
    length, step = values.shape[-1], 1
    while step < length:
        blank = torch.full_like(values[..., :step], -torch.inf)
        parts = [blank, values[..., :-step]] if side > 0 else [values[..., step:], blank]
        values = torch.maximum(values, torch.cat(parts, -1))
        step *= 2
    return values
