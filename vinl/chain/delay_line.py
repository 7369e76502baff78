"""Joint targets that reach the motors late."""

from __future__ import annotations

from collections import deque

import numpy as np
from jaxtyping import Float


class DelayLine:
    """Hands joint targets on some physics steps late."""

    def __init__(self, late: int, first: Float[np.ndarray, "12"], substeps: int) -> None:
        """``late`` in physics steps; ``first`` is what the motors hold before anything arrives; ``substeps`` a call."""
        self._late, self._substeps = late, substeps
        calls = -(-late // substeps)
        self._targets = deque([first.copy() for _ in range(calls + 1)], maxlen=calls + 1)

    def push(self, target: Float[np.ndarray, "12"]) -> list[Float[np.ndarray, "12"]]:
        """What reaches the motors in each of the next physics steps."""
        self._targets.append(target.copy())
        newest = len(self._targets) - 1
        return [self._targets[newest + (s - self._late) // self._substeps] for s in range(self._substeps)]
