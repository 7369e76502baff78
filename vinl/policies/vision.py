"""Networks that turn a depth image into a short vector: the paper's small CNN and the navigator's ResNet-18."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import torch
from jaxtyping import Float
from torch import Tensor, nn
from torch.nn import functional

_SMALL = 80
"""Images lower than this get a smaller first convolution: 8 x 8 with stride 4 would leave nothing of the map."""

_LARGE = 128
"""Images at least this large are averaged over 2 x 2 pixels before the ResNet [ViNL resnet_policy.py]."""

_COMPRESSED = 2048
"""Numbers that the ResNet's map is compressed to [ViNL resnet_policy.py]."""


class Vision(nn.Module):
    """An image with values in [0, 1] to a vector. Under autocast the convolutions run in the reduced type.

    Attributes:
        layers: from (n, channels, H, W) to (n, size), ReLU at the end.
        channels: 1, or 2: depth, and 1 where the image is marked as lost (``vinl.sensing.preparation.MARK``).
        channels_last: whether the images go in with channels last, which is faster without norms in between.
        pool: images are averaged over squares of so many pixels first.
    """

    layers: nn.Sequential
    channels: int = 1
    channels_last: bool = False
    pool: int = 1

    def forward(self, images: Float[Tensor, "n height width"]) -> Float[Tensor, "n size"]:
        """Feature vectors, float32 or the type of autocast."""
        kind = images.device.type
        wanted = torch.get_autocast_dtype(kind) if torch.is_autocast_enabled(kind) else next(self.parameters()).dtype
        images = images.to(wanted)
        # one channel: (n, H, W, 1) turned round has the strides of "channels last" without a copy
        if self.channels == 2:
            planes = torch.stack([images.clamp(min=0.0), (images < 0.0).to(wanted)], -1).permute(0, 3, 1, 2)
        else:
            planes = images[..., None].permute(0, 3, 1, 2) if self.channels_last else images[:, None]
        return self.layers(functional.avg_pool2d(planes, self.pool) if self.pool > 1 else planes)


class SmallCnn(Vision):
    """Three convolutions and a linear layer [ViNL simple_cnn.py: 32 8x8 s4, 64 4x4 s2, 32 3x3, no ReLU after it].

    Images lower than 80 pixels get a first convolution of 5 x 5 with stride 2, and padding.
    """

    channels_last = True

    def __init__(self, height: int, width: int, size: int, channels: int = 1) -> None:
        super().__init__()
        self.channels = channels
        small = min(height, width) < _SMALL
        first = nn.Conv2d(channels, 32, 5, 2, 2) if small else nn.Conv2d(channels, 32, 8, 4)
        pad = 1 if small else 0
        maps = nn.Sequential(
            first,
            nn.ReLU(),
            nn.Conv2d(32, 64, 4, 2, pad),
            nn.ReLU(),
            nn.Conv2d(64, 32, 3, 1, pad),
            nn.Flatten(),
        )
        numbers = _count(maps, height, width)
        self.layers = nn.Sequential(*maps, nn.Linear(numbers, size), nn.ReLU())
        _start_weights(self)


class ResNet18(Vision):
    """ResNet-18 with GroupNorm and a compressed map [ViNL resnet_policy.py and resnet.py]."""

    def __init__(self, height: int, width: int, size: int, planes: int = 32, channels: int = 1) -> None:
        super().__init__()
        self.channels = channels
        p = planes
        maps = nn.Sequential(
            nn.Conv2d(channels, p, 7, 2, 3, bias=False),
            GroupNorm(16, p),
            nn.ReLU(),
            nn.MaxPool2d(3, 2, 1),
            *(_Block(p, p, 1), _Block(p, p, 1)),
            *(_Block(p, 2 * p, 2), _Block(2 * p, 2 * p, 1)),
            *(_Block(2 * p, 4 * p, 2), _Block(4 * p, 4 * p, 1)),
            *(_Block(4 * p, 8 * p, 2), _Block(8 * p, 8 * p, 1)),
        )
        self.pool = 2 if min(height, width) >= _LARGE else 1
        cells = _count(maps, height // self.pool, width // self.pool) // (8 * p)
        kept = max(round(_COMPRESSED / cells), 1)
        self.layers = nn.Sequential(
            *maps,
            nn.Conv2d(8 * p, kept, 3, 1, 1, bias=False),
            GroupNorm(1, kept),
            nn.ReLU(),
            nn.Flatten(),
            nn.Linear(kept * cells, size),
            nn.ReLU(),
        )
        _start_weights(self)


class GroupNorm(nn.GroupNorm):
    """Group normalisation in the type of its input: autocast would turn maps to float32 and back around each one.

    The sums inside are float32 whatever the type.

    Attributes:
        kernel: what does the same faster in a training, ``vinl.nav.norm_kernel.group_norm``.
    """

    kernel: Callable[[Tensor, Tensor, Tensor, int, float], tuple[Tensor, ...]] | None = None

    def forward(self, input: Tensor) -> Tensor:
        """Normalised maps of the same shape and type."""
        if self.kernel is not None:
            return self.kernel(input, self.weight, self.bias, self.num_groups, self.eps)[0]
        with torch.autocast(input.device.type, enabled=False):
            if torch.compiler.is_compiling():
                return self._in_two_passes(input)
            weight, bias = self.weight.to(input.dtype), self.bias.to(input.dtype)
            return functional.group_norm(input, self.num_groups, weight, bias, self.eps)

    def _in_two_passes(self, input: Tensor) -> Tensor:
        """The same for ``torch.compile``, which fuses it: its own rule for the derivative subtracts large numbers where
        a map is nearly constant, as those of an image without depth are."""
        wide = torch.promote_types(input.dtype, torch.float32)
        x = input.to(wide).unflatten(1, (self.num_groups, -1)).flatten(3)
        x = x - x.mean((2, 3), keepdim=True)
        x = x * torch.rsqrt(x.square().mean((2, 3), keepdim=True) + self.eps)
        weight, bias = (part.to(wide).view(self.num_groups, -1, 1) for part in (self.weight, self.bias))
        return (x * weight + bias).reshape(input.shape).to(input.dtype)


class _Block(nn.Module):
    """Two convolutions 3 x 3 beside a shortcut."""

    def __init__(self, before: int, after: int, stride: int) -> None:
        super().__init__()
        self.path = nn.Sequential(
            nn.Conv2d(before, after, 3, stride, 1, bias=False),
            GroupNorm(16, after),
            nn.ReLU(),
            nn.Conv2d(after, after, 3, 1, 1, bias=False),
            GroupNorm(16, after),
        )
        self.shortcut: nn.Module = nn.Identity()
        if stride > 1 or before != after:
            self.shortcut = nn.Sequential(nn.Conv2d(before, after, 1, stride, bias=False), GroupNorm(16, after))

    def forward(self, x: Tensor) -> Tensor:
        return functional.relu(self.path(x) + self.shortcut(x))


def _count(maps: nn.Sequential, height: int, width: int) -> int:
    """Numbers in the maps of one image, from the sizes of the layers: to try it on the device that only counts shapes,
    where shipped networks are built, torch loads for more than a second."""
    channels, sides = 1, (height, width)
    for layer in (step for part in maps for step in (part.path if isinstance(part, _Block) else [part])):
        if isinstance(layer, nn.Conv2d | nn.MaxPool2d):
            kernel, stride, pad = (_pair(x) for x in (layer.kernel_size, layer.stride, layer.padding))
            sides = tuple((n + 2 * p - k) // s + 1 for n, k, s, p in zip(sides, kernel, stride, pad, strict=True))
        if isinstance(layer, nn.Conv2d):
            channels = layer.out_channels
    return channels * sides[0] * sides[1]


def _pair(size: Any) -> tuple[int, int]:
    return size if isinstance(size, tuple) else (size, size)


def _start_weights(network: nn.Module) -> None:
    """He's start for convolutions and linear layers, zero biases [ViNL code]. Weights without numbers are left alone:
    to draw those, torch loads for more than a second."""
    for layer in network.modules():
        if isinstance(layer, nn.Conv2d | nn.Linear) and not layer.weight.is_meta:
            nn.init.kaiming_normal_(layer.weight, nonlinearity="relu")
            if layer.bias is not None:
                nn.init.zeros_(layer.bias)
