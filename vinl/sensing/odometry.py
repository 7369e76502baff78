"""Where robots believe to be: their own motion added up, with errors that grow with the distance."""

from __future__ import annotations

import torch
import warp as wp
from jaxtyping import Bool, Float, Int
from torch import Tensor

from vinl.sensing.sensor_config import OdometryConfig
from vinl.sensing.sensor_kernels import draw_uniform
from vinl.sensing.torch_warp import launch


class Odometry:
    """The dead reckoning of n robots.

    ``state`` is what an episode keeps: ``estimate`` (n, 3): x, y [m] where they believe to be, and the error of the
    heading [rad]; ``errors`` (n, 2): factor on distances, and heading lost for each metre [rad/m].
    """

    def __init__(self, config: OdometryConfig, n: int, device: torch.device | str = "cpu") -> None:
        self.config, self._device = config, torch.device(device)
        self.state = {"estimate": torch.zeros(n, 3, device=device), "errors": torch.zeros(n, 2, device=device)}
        self._drawn = torch.zeros(n, 3, device=device)

    def restart(self, key: Int[Tensor, " n"], chosen: Bool[Tensor, " n"], position: Float[Tensor, "n 2"]) -> None:
        """Begin at known places; the errors follow from each robot's key alone."""
        arrays = [wp.from_torch(key), wp.from_torch(self._drawn)]
        launch(draw_uniform, self._drawn.shape, arrays, self._device)
        low, high = self.config.drift
        drift = low + (high - low) * self._drawn[:, 0]
        factor = 1.0 + torch.where(self._drawn[:, 1] < 0.5, -drift, drift)
        errors = torch.stack([factor, self.config.yaw_bias * drift * (2.0 * self._drawn[:, 2] - 1.0)], 1)
        start = torch.cat([position, torch.zeros_like(position[:, :1])], 1)
        for name, fresh in (("errors", errors), ("estimate", start)):
            self.state[name].copy_(torch.where(chosen[:, None], fresh, self.state[name]))

    def advance(self, before: Float[Tensor, "n 2"], after: Float[Tensor, "n 2"]) -> None:
        """The robots went straight from one place to the other [m]."""
        estimate, errors = self.state["estimate"], self.state["errors"]
        step = after - before
        bend = errors[:, 1] * torch.linalg.vector_norm(step, dim=1)
        turn = estimate[:, 2] + 0.5 * bend
        c, s = errors[:, 0] * turn.cos(), errors[:, 0] * turn.sin()
        x, y = step.unbind(1)
        estimate += torch.stack([c * x - s * y, s * x + c * y, bend], 1)
