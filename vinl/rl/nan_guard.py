"""The NaN guard of a training: a few robots whose numbers are not finite are saved and forgotten, many end it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import torch

from vinl.rl.run_folder import LOST, RunFolder

MAX_FRACTION = 1e-3
"""More than this fraction of an iteration's robot steps ends the training; a single one never does."""


class NotFiniteError(Exception):
    """A training cannot go on; the message is one line."""


def judge_losses(
    env: Any, measures: Mapping[str, float], robot_steps: int, iteration: int, folder: RunFolder
) -> str | None:
    """Save the robots whose numbers went wrong in an iteration.

    Args:
        env: asked for their states (``take_lost``, if it keeps them) where ``measures`` has ``not_finite`` above zero;
            else nothing waits for the device.
        measures: of the iteration.
        folder: the states go into its folder ``not_finite``.

    Returns:
        Why the training must end, in one line; None: it goes on.
    """
    count = measures.get("not_finite", 0.0)
    if not count:
        return None
    reasons: dict[str, int] = {}
    for state in env.take_lost() if hasattr(env, "take_lost") else ():
        folder.save_lost({**state, "iteration": iteration})
        reasons[state["reason"]] = reasons.get(state["reason"], 0) + 1
    if count <= max(1.0, MAX_FRACTION * robot_steps):
        return None
    causes = f" ({', '.join(sorted(reasons, key=lambda name: -reasons[name]))})" if reasons else ""
    where = folder.path / LOST
    return (
        f"{count:.0f} of {robot_steps} robot steps in iteration {iteration} were not finite{causes}, more than one in "
        f"a thousand; look at one of them with  vinl replay-nan --state {where}/{FIRST}"
    )


FIRST = "000001.npz"
"""The first state of a run."""


def is_finite(module: torch.nn.Module) -> bool:
    """Whether all weights of a network are finite. Waits for the device."""
    return all(math.isfinite(float(weight.detach().float().sum())) for weight in module.parameters())
