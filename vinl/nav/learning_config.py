"""Network and learning of a training of the navigator: the groups ``network`` and ``ppo`` of ``configs/nav/*.yaml``."""

from __future__ import annotations

import math
from dataclasses import dataclass

from vinl.config.errors import InputError
from vinl.config.limits import check_fields

VISIONS, MEMORIES = ("resnet18", "cnn"), ("lstm", "mlp")
IMAGE_TYPES = ("float16", "uint8")
"""How a roll-out keeps images: half precision, or bytes of 1/255 of the range."""


@dataclass(frozen=True)
class NavNetworkConfig:
    """Sizes of the navigator [ViNL resnet_policy.py]. A config without camera gets no image part.

    Attributes:
        vision: ``resnet18`` or ``cnn`` (three convolutions).
        planes: channels of the ResNet's first stage.
        visual: numbers that the image becomes.
        embedding: numbers that goal and previous action become, each.
        hidden, layers: width and layers of the memory.
        memory: ``lstm``, or ``mlp``, which remembers nothing.
        grid: whether an occupancy grid is kept up from the images, and a path planned on it that the network is told
            of; needs ``previous: step``.
    """

    vision: str = "resnet18"
    planes: int = 32
    visual: int = 512
    embedding: int = 32
    hidden: int = 512
    layers: int = 2
    memory: str = "lstm"
    grid: bool = False

    def __post_init__(self) -> None:
        if self.vision not in VISIONS:
            raise InputError(f"network.vision must be one of {', '.join(VISIONS)}, got {self.vision!r}")
        if self.memory not in MEMORIES:
            raise InputError(f"network.memory must be one of {', '.join(MEMORIES)}, got {self.memory!r}")
        check_fields(self, "network.", counts=("planes", "visual", "embedding", "hidden", "layers"))
        if self.planes % 16 and self.vision == "resnet18":
            raise InputError(f"network.planes must be a multiple of 16 (groups of the norms), got {self.planes}")


@dataclass(frozen=True)
class NavPpoConfig:
    """Proximal policy optimisation over whole sequences.

    Attributes:
        steps: steps of each robot between updates; also how far back errors go through the memory.
        epochs, minibatches: passes over the roll-out and parts (of robots) of each.
        learning_rate: at the start; it then follows ``desired_kl`` within ``min_rate`` and ``max_rate``.
        desired_kl: divergence of an update that the rate is steered to.
        min_rate, max_rate: limits of the rate; without a floor the divergence of ever surer actions brings
            it, and learning with it, to a halt.
        cool_from: from this fraction of the iterations on the limits fall, linearly, towards ``last_rate``; 1: never.
        last_rate: learning rate at the end, see ``cool_from``.
        gamma, lam: discount and GAE factor.
        clip: of the probability ratio and of the value.
        value: weight of the value loss.
        entropy, last_entropy: weight of the entropy bonus at the start and, moving from ``cool_from`` on, at the end;
            null: it stays.
        max_grad_norm: gradients are clipped to this norm.
        log_std, log_std_range: logarithm of the actions' standard deviation at the start, and its limits.
        last_log_std: from ``cool_from`` on the upper limit moves to this: what is shipped acts without chance, and
            only training almost without chance shows it where it would get stuck; null: the limit stays.
        critic_warmup: in so many first updates only the critic's own layer learns: one that starts afresh beside the
            weights of a policy (``--from``) would otherwise teach them nonsense.
        image_type: how the roll-out keeps images: ``float16``, or ``uint8`` in half the memory.
        bf16: images in bfloat16 (GPU only).
        compiled: image network and plans through ``torch.compile``, the memory's loop as one CUDA graph (GPU only): a
            minute at the start, then faster.
        keep_at: the policy is also kept aside once after so many samples.
    """

    steps: int = 24
    epochs: int = 2
    minibatches: int = 4
    learning_rate: float = 5e-4
    desired_kl: float = 0.01
    min_rate: float = 2e-4
    max_rate: float = 1.5e-3
    cool_from: float = 0.7
    last_rate: float = 5e-5
    gamma: float = 0.99
    lam: float = 0.95
    clip: float = 0.2
    value: float = 0.5
    entropy: float = 0.003
    last_entropy: float | None = None
    max_grad_norm: float = 0.5
    log_std: float = -0.5
    log_std_range: tuple[float, float] = (-2.0, 0.2)
    last_log_std: float | None = None
    critic_warmup: int = 0
    image_type: str = "float16"
    bf16: bool = True
    compiled: bool = True
    keep_at: tuple[float, ...] = (2.5e6, 1e7, 2e7, 5e7, 1e8, 2e8, 5e8)

    def __post_init__(self) -> None:
        check_fields(
            self,
            "ppo.",
            counts=("steps", "epochs", "minibatches"),
            positive=("desired_kl", "last_rate", "clip", "max_grad_norm", "gamma"),
            unsigned=("value", "entropy", "last_entropy", "critic_warmup"),
            fractions=("gamma", "lam", "cool_from"),
        )
        if self.image_type not in IMAGE_TYPES:
            raise InputError(f"ppo.image_type must be one of {', '.join(IMAGE_TYPES)}, got {self.image_type!r}")
        if not 0 < self.min_rate <= self.learning_rate <= self.max_rate:
            raise InputError("ppo: need 0 < min_rate <= learning_rate <= max_rate")
        low, high = self.log_std_range
        if not low <= self.log_std <= high or not math.isfinite(low + high):
            raise InputError(f"ppo.log_std must lie within log_std_range {low:g} to {high:g}, got {self.log_std:g}")
        if self.last_log_std is not None and not low <= self.last_log_std <= high:
            raise InputError(f"ppo.last_log_std must lie within log_std_range, got {self.last_log_std:g}")

    def rate_limits(self, fraction: float) -> tuple[float, float]:
        """Lowest and highest learning rate after a fraction of the iterations."""
        cooled, low = self._cooled(fraction), self.min_rate
        low += cooled * (min(self.last_rate, low) - low)
        return low, max(low, self.max_rate + cooled * (self.last_rate - self.max_rate))

    def entropy_at(self, fraction: float) -> float:
        """Weight of the entropy bonus after a fraction of the iterations."""
        last = self.entropy if self.last_entropy is None else self.last_entropy
        return self.entropy + self._cooled(fraction) * (last - self.entropy)

    def spread_at(self, fraction: float) -> tuple[float, float]:
        """Limits of the logarithm of the actions' standard deviation after a fraction of the iterations."""
        low, high = self.log_std_range
        last = high if self.last_log_std is None else self.last_log_std
        return low, high + self._cooled(fraction) * (last - high)

    def _cooled(self, fraction: float) -> float:
        return min(max((fraction - self.cool_from) / (1.0 - self.cool_from), 0.0), 1.0) if self.cool_from < 1 else 0.0
