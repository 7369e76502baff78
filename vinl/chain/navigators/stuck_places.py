"""Places where a robot was stuck: its navigator sees a post there for a while, and goes another way."""

from __future__ import annotations

import numpy as np
import torch
from jaxtyping import Bool, Float

from vinl.robot.cameras import Camera

AHEAD = 0.45
"""Distance from the middle of a robot that is stuck to the middle of the post [m]: its nose is at 0.34 m."""

RADIUS = 0.25
"""Of a post [m]. It fills a gap that is too narrow for the robot, and leaves half of a doorway open."""

LASTS = 30.0
"""Seconds that a post stands: time to find another way, if there is one."""


class StuckPlaces:
    """Remembers where each of n robots was stuck, and draws posts there into what its camera sees.

    A navigator that was freed sees what it saw before, and walks into the same gap again. A post in it is like
    anything else that it learned to walk around. Robots know how they moved, as they know where their goal is: no more
    is asked for here.

    Args:
        n: robots.
        camera: of the navigator.
        period: between two decisions [s].
    """

    def __init__(self, n: int, camera: Camera, period: float) -> None:
        self._camera, self._lasts, self._now = camera, round(LASTS / period), 0
        self._posts: list[list[tuple[np.ndarray, int]]] = [[] for _ in range(n)]  # place, and until when
        tx, ty = camera.tan_half
        left = tx * (1.0 - (2.0 * np.arange(camera.width) + 1.0) / camera.width)
        up = ty * (1.0 - (2.0 * np.arange(camera.height) + 1.0) / camera.height)
        axes = camera.rotation().T
        # through the middles of the pixels, in the trunk frame; as long as to be 1 along the optical axis
        self._rays = (axes[0] + left[None, :, None] * axes[1] + up[:, None, None] * axes[2])[..., :2]

    def remember(self, stuck: Bool[np.ndarray, " n"], pose: Float[np.ndarray, "n 3"]) -> None:
        """Put a post before each robot that is stuck.

        Args:
            stuck: which they are.
            pose: x, y [m] and yaw [rad] now.
        """
        for k in np.flatnonzero(stuck).tolist():
            x, y, yaw = pose[k]
            place = np.array([x + AHEAD * np.cos(yaw), y + AHEAD * np.sin(yaw)])
            self._posts[k].append((place, self._now + self._lasts))

    def draw(
        self, pose: Float[np.ndarray, "n 3"], depth: Float[torch.Tensor, "n height width"]
    ) -> Float[torch.Tensor, "n height width"]:
        """What the robots see at their next decision. Posts are upright and without end; the trunk is taken for level.

        Args:
            pose: x, y [m] and yaw [rad] now.
            depth: of their cameras [m]; left as it is.

        Returns:
            The same with posts; ``depth`` itself if there are none.
        """
        self._now += 1
        shown = depth
        for k, posts in enumerate(self._posts):
            posts[:] = [post for post in posts if post[1] > self._now]
            if posts:
                shown = depth.clone() if shown is depth else shown
                nearest = torch.from_numpy(self._distance(pose[k], [place for place, _ in posts]))
                shown[k] = torch.minimum(shown[k], nearest.to(shown))
        return shown

    def _distance(self, pose: Float[np.ndarray, "3"], places: list[np.ndarray]) -> Float[np.ndarray, "height width"]:
        """Depth [m] at which each ray meets a post; infinite where it meets none, or begins within it."""
        c, s = np.cos(pose[2]), np.sin(pose[2])
        turn = np.array([[c, -s], [s, c]])
        rays, eye = self._rays @ turn.T, pose[:2] + turn @ np.array(self._camera.position[:2])
        nearest = np.full(rays.shape[:2], np.inf)
        for place in places:
            to = eye - place
            a, b, outside = (rays**2).sum(-1), rays @ to, to @ to - RADIUS**2
            root = b * b - a * outside
            met = (root > 0) & (b < 0) & (outside > 0)
            nearest[met] = np.minimum(nearest[met], ((-b - np.sqrt(np.where(met, root, 0.0))) / a)[met])
        return nearest
