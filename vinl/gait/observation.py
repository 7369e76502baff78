"""What policies with a gait observe: proprioception, and the rows that the gait adds to it."""

from __future__ import annotations

from vinl.gait.path import GAIT_TERMS
from vinl.robot.observation import PROPRIOCEPTION, ObservationTable, ObservationTerm

GAIT_ROWS = tuple(ObservationTerm(name, size, (scale,), 0.0, unit) for name, size, scale, unit in GAIT_TERMS)

STEPPING_TABLE = ObservationTable((*PROPRIOCEPTION.terms, *GAIT_ROWS))
"""What an actor observes whose footholds come from a map: 48 numbers of the robot's own and 36 of its gait."""

SENSED_TABLE = ObservationTable(PROPRIOCEPTION.terms[1:])
"""What a robot measures of itself: proprioception without the velocity of its trunk, 45 numbers."""

assert PROPRIOCEPTION.terms[0].name == "base_linear_velocity"
