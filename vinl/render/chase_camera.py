"""A camera that follows the robot through a home without putting a wall in between."""

from __future__ import annotations

import math

import numpy as np
from jaxtyping import Float

from vinl.render.raytrace import RayRenderer, View, look_at


class ChaseCamera:
    """Follows from behind and above; rises, then comes closer, where a wall or a cupboard would hide the robot.

    Args:
        renderer: knows what stands in the way; without one the camera flies freely.
        distance: from the robot [m].
        elevation: angle above the horizon while nothing is in the way [rad].
        smoothing: fraction of the way to the wanted pose that the camera covers at each call, 1 follows at once.
    """

    def __init__(
        self,
        renderer: RayRenderer | None = None,
        distance: float = 2.5,
        elevation: float = math.radians(38),
        smoothing: float = 0.08,
    ) -> None:
        self._renderer, self._distance, self._elevation = renderer, distance, elevation
        self._smoothing = smoothing
        self._state: np.ndarray | None = None

    def follow(self, trunk: Float[np.ndarray, " 3"], yaw: float) -> View:
        """The camera's pose for the robot's pose; call it once a frame.

        Args:
            trunk: position [m].
            yaw: heading [rad].
        """
        target = np.array([trunk[0], trunk[1], 0.3])
        if self._state is None:
            self._state = np.array([*target, yaw, *self._choose(target, yaw)])
        kept = self._state
        step = self._smoothing
        kept[:3] += min(1.0, 3 * step) * (target - kept[:3])
        kept[3] += step * math.remainder(yaw - kept[3], 2 * math.pi)
        elevation, distance = self._choose(kept[:3], kept[3])
        # Up at once when hidden soon, down at leisure.
        kept[4] += (step if elevation < kept[4] else min(1.0, 2.5 * step)) * (elevation - kept[4])
        kept[5] += step * (distance - kept[5])
        return look_at(self._eye(kept[:3], *kept[3:]), kept[:3])

    def _choose(self, target: np.ndarray, yaw: float) -> tuple[float, float]:
        """The lowest elevation [rad], and then the longest distance [m], from which the robot is seen."""
        if self._renderer is None:
            return self._elevation, self._distance
        side = 0.2 * np.array([-math.sin(yaw), math.cos(yaw), 0.0])
        for fraction in (1.0, 0.75):
            for elevation in np.linspace(self._elevation, math.radians(78), 6):
                eye = self._eye(target, yaw, elevation, fraction * self._distance)
                if all(self._renderer.sees(eye, target + shift) for shift in (side, -side)):
                    return float(elevation), fraction * self._distance
        return math.radians(85), self._distance

    @staticmethod
    def _eye(target: np.ndarray, yaw: float, elevation: float, distance: float) -> np.ndarray:
        flat = distance * math.cos(elevation)
        return target + np.array([-flat * math.cos(yaw), -flat * math.sin(yaw), distance * math.sin(elevation)])
