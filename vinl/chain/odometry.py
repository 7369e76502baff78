"""How robots moved between two decisions of the navigator, and where they believe to be."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import torch
from jaxtyping import Float

from vinl.robot.rotation import wrap_angle
from vinl.sensing.odometry import Odometry
from vinl.sensing.odometry_config import OdometryConfig


def measure_twist(
    before: Float[np.ndarray, "n 3"], after: Float[np.ndarray, "n 3"], period: float
) -> Float[np.ndarray, "n 3"]:
    """The constant forward [m/s], sideways [m/s] and yaw [rad/s] rates that lead from one pose to the other on an arc.

    Args:
        before, after: x, y [m] and yaw [rad].
        period: between them [s].
    """
    step = after[:, :2] - before[:, :2]
    turn = wrap_angle(after[:, 2] - before[:, 2])
    chord = np.sinc(turn / 2 / np.pi)  # chord over arc
    heading = before[:, 2] + turn / 2
    c, s = np.cos(heading), np.sin(heading)
    forward, left = c * step[:, 0] + s * step[:, 1], -s * step[:, 0] + c * step[:, 1]
    return np.stack([forward / chord, left / chord, turn], 1) / period


class DeadReckoning:
    """The odometry of n robots; the same key gives the same errors.

    Args:
        config: errors.
        keys: (n,) below 2^31.
    """

    def __init__(self, config: OdometryConfig, keys: Sequence[int]) -> None:
        self._odometry = Odometry(config, len(keys))
        self._keys = torch.tensor(list(keys), dtype=torch.int32)
        self._at: torch.Tensor | None = None

    def follow(self, pose: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 3"]:
        """Where the robots believe to be, x, y [m] and yaw [rad], when they are at ``pose``; the first call is the
        start, which they know."""
        at = torch.as_tensor(pose[:, :2], dtype=torch.float32)
        if self._at is None:
            self._odometry.restart(self._keys, torch.ones(len(at), dtype=torch.bool), at)
        else:
            self._odometry.advance(self._at, at)
        self._at = at
        believed = self._odometry.state["estimate"].numpy().astype(np.float64)
        return np.column_stack([believed[:, :2], pose[:, 2] + believed[:, 2]])
