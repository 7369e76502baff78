"""What is counted while robots drive: sums over the episodes that ended, and over all steps, on the device."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import torch
from jaxtyping import Bool, Float, Int
from torch import Tensor

from vinl.world.endings import LOOPING_PATHS

STUCK_STEPS = 10
"""An episode that runs out of time after at least so many cancelled steps in a row counts as stuck."""


class EpisodeEnd(NamedTuple):
    """The figures of the episodes that ended in the last step; other rows mean nothing.

    Attributes:
        counted: an episode ended there.
        home: slot of the home.
        success: 1 where the goal was reached.
        spl: success weighted by path length [Anderson et al. 2018].
        soft_spl: the fraction of the path that was made, weighted likewise [habitat].
        collisions: cancelled steps.
        steps: of the episode.
        path: path moved [m].
        start_distance, end_distance: geodesic distance to the goal [m].
        stuck, looping, out_of_time: 1 for the reason why the goal was not reached.
    """

    counted: Bool[Tensor, " n"]
    home: Int[Tensor, " n"]
    success: Float[Tensor, " n"]
    spl: Float[Tensor, " n"]
    soft_spl: Float[Tensor, " n"]
    collisions: Float[Tensor, " n"]
    steps: Float[Tensor, " n"]
    path: Float[Tensor, " n"]
    start_distance: Float[Tensor, " n"]
    end_distance: Float[Tensor, " n"]
    stuck: Float[Tensor, " n"]
    looping: Float[Tensor, " n"]
    out_of_time: Float[Tensor, " n"]


def end_episodes(state: Mapping[str, Tensor], counted: Bool[Tensor, " n"], success: Bool[Tensor, " n"]) -> EpisodeEnd:
    """The figures of the episodes of robots in a state, see ``NavEnvironment``.

    SPL compares with the distance at the start, as habitat does, so that the last metres, within the radius of success,
    are given to the robot.
    """
    start, path, end = state["start_distance"], state["path"], state["distance"]
    reached = success.float()
    efficiency = start / torch.maximum(path, start)
    progress = (1.0 - end / start).clamp(0.0, 1.0)
    late = 1.0 - reached
    stuck = late * (state["in_a_row"] >= STUCK_STEPS)
    looping = late * (1.0 - stuck) * (path > LOOPING_PATHS * start)
    return EpisodeEnd(
        counted=counted,
        home=state["home"].clone(),
        success=reached,
        spl=reached * efficiency,
        soft_spl=torch.where(success, 1.0, progress) * efficiency,
        collisions=state["collisions"].clone(),
        steps=state["steps"].clone(),
        path=path.clone(),
        start_distance=start.clone(),
        end_distance=end.clone(),
        stuck=stuck,
        looping=looping,
        out_of_time=late - stuck - looping,
    )


_NAMES = ("episodes", *EpisodeEnd._fields[2:])


class Measures:
    """Sums since they were last read.

    Args:
        device: that they are kept on.
    """

    def __init__(self, device: torch.device) -> None:
        self._ended = torch.zeros(len(_NAMES), dtype=torch.float64, device=device)
        self._steps = torch.zeros(4, dtype=torch.float64, device=device)

    def add(
        self,
        end: EpisodeEnd,
        reward: Float[Tensor, " n"],
        blocked: Float[Tensor, " n"],
        moved: Float[Tensor, " n"],
    ) -> None:
        """Count a step of all robots."""
        rows = torch.stack([end.counted.float(), *(getattr(end, name) for name in _NAMES[1:])])
        self._ended += torch.where(end.counted, rows, 0.0).sum(1, dtype=torch.float64)
        step = torch.stack([torch.ones_like(reward), reward, blocked, moved])
        self._steps += step.sum(1, dtype=torch.float64)

    def read(self, unplaced: Tensor) -> dict[str, float]:
        """Means, and set everything to zero; the host waits once for the device.

        Args:
            unplaced: (n,) starts that no good place was found for; set to zero too.
        """
        values = torch.cat([self._ended, self._steps, unplaced.sum(dtype=torch.float64)[None]]).tolist()
        for sums in (self._ended, self._steps, unplaced):
            sums.zero_()
        ended, steps = dict(zip(_NAMES, values[: len(_NAMES)], strict=True)), max(values[-5], 1.0)
        episodes = ended.pop("episodes")
        measures = {"episodes": episodes}
        if episodes > 0:
            measures |= {name: value / episodes for name, value in ended.items()}
        return measures | {
            "reward": values[-4] / steps,
            "blocked": values[-3] / steps,
            "step_length": values[-2] / steps,
            "unplaced": values[-1],
        }
