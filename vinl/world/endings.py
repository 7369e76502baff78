"""How an episode ends: the names and rules that the navigator alone and the whole chain are judged by alike."""

from __future__ import annotations

import math

SUCCESS, FALL, STUCK, LOOPING, TIMEOUT = "success", "fall", "stuck", "looping", "timeout"
END_REASONS = (SUCCESS, FALL, STUCK, LOOPING, TIMEOUT)
"""The last three are all episodes that ran out of time, told apart by what the robot did with it."""

MAX_TILT = math.radians(72)
"""A trunk tilted farther than this has fallen [rad], in training and in every evaluation."""

LOOPING_PATHS = 3.0
"""A robot that ran out of time and was not stuck, but moved more than so many times the shortest path, went in circles
or to and fro. At the speeds of the paper one that only took a long path around stays below."""


def name_late_end(stuck: bool, moved_m: float, shortest_m: float) -> str:
    """Why an episode ran out of time: the robot no longer got anywhere (each simulator has its own way to see that), or
    its path was long beside the shortest one [m]."""
    if stuck:
        return STUCK
    return LOOPING if moved_m > LOOPING_PATHS * shortest_m else TIMEOUT
