"""What frees a robot that does not come on: it backs up, turns away, then goes ahead."""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Float

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


class Recovery:
    """Watches n robots and overrules the choice for those that are stuck.

    A robot sees what is ahead of it, and what holds it, a leg behind the arm of a sofa, is not there. It is told the
    same for ever, for nothing that it sees changes. To do something else is all that helps, and where it came from
    there was room for it.

    Args:
        n: robots.
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
