"""What policies with a gait observe: proprioception, and the rows that the gait adds to it."""

from __future__ import annotations

from typing import Any

from vinl.gait.arrays import constant
from vinl.gait.config import GaitConfig
from vinl.gait.path import GAIT_TERMS, gait_rows
from vinl.gait.state import GaitState
from vinl.robot.observation import CLIP, HEIGHT_SCAN, PROPRIOCEPTION, ObservationTable, ObservationTerm

_NOISE = {"path_error": 0.01, "path_ahead": 0.01, "foothold": 0.02, "apex": 0.01}
"""Half-width of the noise in training [m], about the error of a plan that is read from images; the clock has none."""

GAIT_ROWS = tuple(
    ObservationTerm(name, size, (scale,), _NOISE.get(name, 0.0), unit) for name, size, scale, unit in GAIT_TERMS
)

_SCALE = ObservationTable(GAIT_ROWS).scale

STEPPING_TABLE = ObservationTable((*PROPRIOCEPTION.terms, *GAIT_ROWS))
"""What an actor observes whose footholds come from a map: 48 numbers of the robot's own and 63 of its gait."""

STEPPING_MAP_TABLE = ObservationTable((*STEPPING_TABLE.terms, HEIGHT_SCAN))
"""The same, and the height scan: what critics observe."""

SENSED_TABLE = ObservationTable(PROPRIOCEPTION.terms[1:])
"""What a robot measures of itself: proprioception without the velocity of its trunk, 45 numbers."""

assert PROPRIOCEPTION.terms[0].name == "base_linear_velocity"


def observe_gait(xp: Any, config: GaitConfig, gait: GaitState, feet: Any, latency: Any) -> Any:
    """(n, 63) the rows of the gait as a policy observes them, scaled; arguments as for ``path.gait_rows``."""
    rows = gait_rows(xp, config, gait, feet, latency)
    return xp.clip(rows * constant(xp, _SCALE, rows), -CLIP, CLIP)


def insert_gait(xp: Any, observation: Any, rows: Any) -> Any:
    """An observation that begins with proprioception, with the rows of the gait behind that."""
    k = PROPRIOCEPTION.size
    return xp.concatenate([observation[..., :k], rows, observation[..., k:]], -1)
