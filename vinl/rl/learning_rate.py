"""A learning rate that lives on the device: it follows the divergence of the policy without the host waiting."""

from __future__ import annotations

import torch
from torch import Tensor


class DeviceRate:
    """A learning rate that the optimiser reads from the device, steered to a divergence.

    It falls by ``down`` where the divergence is more than twice ``desired_kl`` and rises by ``up`` where it is less
    than half of it [rsl-rl], within limits.

    Args:
        low, high: limits.
        desired_kl: divergence to keep to; None: the rate stays, within the limits.

    Attributes:
        value: () the rate; hand it to the optimiser.
    """

    def __init__(
        self,
        start: float,
        low: float = 1e-5,
        high: float = 1e-2,
        desired_kl: float | None = 0.01,
        down: float = 1.5,
        up: float = 1.5,
        device: torch.device | str = "cpu",
    ) -> None:
        self.value = torch.tensor(start, dtype=torch.float32, device=device)
        self._limits = torch.tensor([low, high], dtype=torch.float32, device=device)
        self._ends = (low, high)
        self.desired_kl, self._down, self._up = desired_kl, down, up

    def steer(self, kl: Tensor) -> None:
        """Follow a divergence (), without waiting for it."""
        if self.desired_kl is None:
            return
        slower = torch.where(kl > 2.0 * self.desired_kl, self.value / self._down, self.value)
        faster = (kl < 0.5 * self.desired_kl) & (kl > 0.0)
        self.value.copy_(torch.where(faster, self.value * self._up, slower))
        self._clip()

    def limit(self, low: float, high: float) -> None:
        """Move the limits."""
        if (low, high) != self._ends:
            self._ends = (low, high)
            self._limits.copy_(torch.tensor([low, high], dtype=torch.float32), non_blocking=True)
        self._clip()

    def set(self, rate: float) -> None:
        """Take another rate."""
        self.value.fill_(rate)

    def read(self) -> float:
        """The rate as a number; waits for the device."""
        return float(self.value)

    def bind(self, optimizer: torch.optim.Optimizer) -> None:
        """Have all groups of an optimiser read this rate, also after it has loaded a state of its own."""
        for group in optimizer.param_groups:
            group["lr"] = self.value

    def _clip(self) -> None:
        torch.clamp(self.value, self._limits[0], self._limits[1], out=self.value)
