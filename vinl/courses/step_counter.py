"""Steps of the feet, one by one, and in which of them something was touched."""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool

_STEADY = 2
"""A foot has lifted off, or come down, when it was so for this many control steps in a row."""


class StepCounter:
    """Counts the steps of n robots, and the dirty ones.

    A step is one swing of a foot and the stance after it, from one lift-off to the next. It is dirty if, meanwhile,
    this foot or its leg (hip, thigh, shank) touched an object. A foot that is stopped by an object for two control
    steps or more and then lifted again has made two steps.

    Attributes:
        steps: (n,) completed steps.
        dirty: (n,) those in which the foot or its leg touched an object.
        dirty_foot: (n,) those in which the foot did.
    """

    def __init__(self, n: int) -> None:
        self.steps, self.dirty, self.dirty_foot = (np.zeros(n, int) for _ in range(3))
        self._down, self._changing = np.ones((n, 4), bool), np.zeros((n, 4), int)
        self._open = np.zeros((n, 4), bool)
        self._touched, self._lifting = np.zeros((2, n, 4), bool), np.zeros((2, n, 4), bool)  # by foot, by leg

    def add(
        self,
        stance: Bool[np.ndarray, "n 4"],
        feet: Bool[np.ndarray, "n 4"],
        legs: Bool[np.ndarray, "n 4"],
        counted: Bool[np.ndarray, " n"],
    ) -> None:
        """One control step of all robots.

        Args:
            stance: which feet carry, on whatever.
            feet, legs: which of them touch an object.
            counted: whose steps count that begin now.
        """
        self._changing = np.where(stance == self._down, 0, self._changing + 1)
        # touches of a lift-off belong to the new step, as soon as it is one
        lifting, touches = self._down & (self._changing > 0), np.stack([feet, legs])
        self._touched |= (touches | self._lifting) & ~lifting
        self._lifting = (touches | self._lifting) & lifting
        changed = self._changing >= _STEADY
        lifted = changed & self._down
        self._close(lifted)
        self._touched[:, lifted] = self._lifting[:, lifted]
        self._open |= lifted & counted[:, None]
        self._changing[changed], self._lifting[:, changed] = 0, False
        self._down ^= changed

    def restart(self, which: Bool[np.ndarray, " n"], fallen: Bool[np.ndarray, " n"]) -> None:
        """Some robots stand anew. Steps that they had begun are dropped, those in which they fell count."""
        rows = np.broadcast_to(which[:, None], self._open.shape)
        self._close(rows & fallen[:, None])
        self._open[which], self._touched[:, which], self._lifting[:, which] = False, False, False
        self._down[which], self._changing[which] = True, 0

    def _close(self, ended: Bool[np.ndarray, "n 4"]) -> None:
        done = self._open & ended
        for counts, flags in (
            (self.steps, done),
            (self.dirty, done & self._touched.any(0)),
            (self.dirty_foot, done & self._touched[0]),
        ):
            counts += flags.sum(1)
        self._open[ended], self._touched[:, ended] = False, False
