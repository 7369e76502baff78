"""What frees a robot that does not come on: it backs up, turns away, then goes ahead."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import torch
from jaxtyping import Bool, Float

from vinl.chain.navigators.base import Navigator, Task
from vinl.policies.card import YAW_RATE
from vinl.robot.cameras import Camera
from vinl.robot.rotation import wrap_angle

_STILL, _STILL_M, _STILL_RAD = 6, 0.12, 0.2
"""A robot that in so many decisions (3 s) moved [m] and turned [rad] less than this is stuck."""

_PART, _LONGEST = 2, 8
"""Decisions that it walks back, turns, and walks ahead at the first try (1 s each), so much longer at each further one,
and at most."""

_BACK_SPEED = -0.3
"""Forward speed of a robot that walks back [m/s]. No navigator asks for it, but every locomotor descends from one that
was trained to (``configs/loco/rough.yaml``); faster than that they were never tried."""

_TURNED = 0.4
"""A robot that turned by less than this [rad] had no room to, and would walk into the same place: it does not."""

_AWAY_M = 1.0
"""A robot that is stuck so far from where it was stuck last starts anew with the first try [m]."""

_AHEAD_SPEED = 0.5
"""Forward speed of a robot that is being freed [m/s]: half of what it can do."""


class RecoveringNavigator:
    """Any navigator, whose robots are freed where they are stuck: off by default, and no part of any policy.

    Robots that have not moved or turned for 3 s back up, turn away and walk on, whatever the navigator says
    (``Recovery``), and it sees a post where they were stuck (``StuckPlaces``). Both use the poses that odometry gives.

    Args:
        inner: decides while nothing is stuck. If it has a method ``overrule``, it is told which robots do something
            else, and what.
        period: between two decisions [s].

    Attributes:
        inner: as given.
        camera: of the inner navigator.
    """

    def __init__(self, inner: Navigator, period: float = 0.5) -> None:
        self.inner, self._period = inner, period
        self.camera: Camera | None = inner.camera
        self.reset([])

    @property
    def name(self) -> str:
        """Of the inner navigator, and that it is freed."""
        return f"{getattr(self.inner, 'name', type(self.inner).__name__)} with recovery"

    def reset(self, episodes: Sequence[Task]) -> None:
        """See ``Navigator.reset``."""
        self.inner.reset(episodes)
        self._recovery = Recovery(len(episodes), _AHEAD_SPEED, YAW_RATE[1])
        self._places = None if self.camera is None else StuckPlaces(len(episodes), self.camera, self._period)

    def act(self, observation: dict[str, Any]) -> Float[np.ndarray, "n 2"]:
        """See ``Navigator.act``."""
        pose = np.asarray(observation["pose"], np.float64)
        if self._places is not None:
            observation = observation | {"depth": self._places.draw(pose, observation["depth"])}
        choice, freed = self._recovery.correct(pose, self.inner.act(observation))
        if self._places is not None:
            self._places.remember(self._recovery.found, pose)
        overrule = getattr(self.inner, "overrule", None)
        if overrule is not None:
            overrule(freed, choice)
        return choice


class Recovery:
    """Watches n robots and overrules the choice for those that are stuck.

    A robot sees what is ahead of it, and what holds it, a leg behind the arm of a sofa, is not there. It is told the
    same for ever, for nothing that it sees changes. To do something else is all that helps, and where it came from
    there was room for it.

    Args:
        speed: at which a robot walks ahead once it has turned [m/s].
        turn_rate: at which it turns [rad/s].

    Attributes:
        found: (n,) whether a robot was found to be stuck at the last decision.
    """

    def __init__(self, n: int, speed: float, turn_rate: float) -> None:
        self._speed, self._rate = speed, turn_rate
        self._past: list[np.ndarray] = []
        self._backs, self._turns, self._walks = np.zeros((3, n), int)  # decisions left of each
        self._calm = np.zeros(n, int)  # decisions until it may be called stuck again
        self._tries, self._side = np.zeros(n, int), np.ones(n)
        self._where, self._yaw = np.full((n, 2), np.inf), np.zeros(n)
        self.found = np.zeros(n, bool)

    def correct(
        self, pose: Float[np.ndarray, "n 3"], choice: Float[np.ndarray, "n 2"]
    ) -> tuple[Float[np.ndarray, "n 2"], Bool[np.ndarray, " n"]]:
        """What the robots are to do.

        Args:
            pose: x, y [m] and yaw [rad] now.
            choice: forward speed [m/s] and yaw rate [rad/s] that the navigator wants.

        Returns:
            The choice, for robots that are being freed another one, and who these are.
        """
        self._past = [*self._past, pose.copy()][-_STILL - 1 :]
        stuck = self.found = self._are_still(pose) & (self._calm == 0)
        again = stuck & (np.linalg.norm(pose[:, :2] - self._where, axis=1) < _AWAY_M)
        self._side = np.where(again, -self._side, np.where(stuck, np.where(choice[:, 1] > 0, -1.0, 1.0), self._side))
        self._where[stuck & ~again] = pose[stuck & ~again, :2]
        self._yaw[stuck] = pose[stuck, 2]
        self._tries[stuck] = np.where(again, self._tries + 1, 1)[stuck]
        for part in (self._backs, self._turns, self._walks):
            part[stuck] = np.minimum(_PART * self._tries[stuck], _LONGEST)
        backs = self._backs > 0
        turns = ~backs & (self._turns > 0)
        self._walks[~backs & ~turns & (np.abs(wrap_angle(pose[:, 2] - self._yaw)) < _TURNED)] = 0
        walks = ~backs & ~turns & (self._walks > 0)
        freed = backs | turns | walks
        choice = choice.copy()
        choice[backs] = _BACK_SPEED, 0.0
        choice[turns] = np.stack([np.zeros(len(pose)), self._side * self._rate], 1)[turns]
        choice[walks] = self._speed, 0.0
        self._backs[backs] -= 1
        self._turns[turns] -= 1
        self._walks[walks] -= 1
        # the decisions of the recovery itself say nothing on whether it helped
        self._calm = np.where(freed, _STILL, np.maximum(self._calm - 1, 0))
        return choice, freed

    def _are_still(self, pose: Float[np.ndarray, "n 3"]) -> Bool[np.ndarray, " n"]:
        if len(self._past) <= _STILL:
            return np.zeros(len(pose), bool)
        change = np.array(self._past) - pose
        turned = np.abs(wrap_angle(change[..., 2])).max(0)
        return (np.linalg.norm(change[..., :2], axis=-1).max(0) < _STILL_M) & (turned < _STILL_RAD)


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
