"""Where the robots of a unit believe to be, from one decision of the navigator to the next."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import torch
from jaxtyping import Float

from vinl.sensing.odometry import Odometry
from vinl.sensing.odometry_config import OdometryConfig


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
