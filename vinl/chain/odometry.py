"""How a robot moved between two poses."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from vinl.robot.rotation import wrap_angle


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
