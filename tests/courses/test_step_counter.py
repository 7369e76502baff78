"""Steps of the feet, and which of them are dirty."""

import numpy as np

from vinl.courses.robot_records import StepCounter

ALL = np.ones(1, bool)
LEG, NONE = np.array([[True, False, False, False]]), np.zeros((1, 4), bool)


def walk(counter: StepCounter, pattern: str, feet: str = "", legs: str = "", counted: np.ndarray = ALL) -> None:
    """The front left foot: ``-`` swings, ``_`` carries; ``x`` in ``feet`` or ``legs`` at the same place: it touches."""
    for k, state in enumerate(pattern):
        stance = np.array([[state == "_", True, True, True]])
        touch = [LEG if text[k : k + 1] == "x" else NONE for text in (feet, legs)]
        counter.add(stance, *touch, counted)


def test_a_step_is_a_swing_and_the_stance_after_it():
    counter = StepCounter(1)
    walk(counter, "____----____----____---")
    assert (counter.steps[0], counter.dirty[0]) == (2, 0)


def test_a_touch_in_swing_or_stance_makes_one_step_dirty():
    for place in (5, 9):
        counter = StepCounter(1)
        walk(counter, "____----____----____---", " " * place + "x")
        assert (counter.steps[0], counter.dirty[0], counter.dirty_foot[0]) == (2, 1, 1)
    counter = StepCounter(1)
    walk(counter, "____----____----____---", "", " " * 14 + "xxxxx")
    assert (counter.steps[0], counter.dirty[0], counter.dirty_foot[0]) == (2, 1, 0)


def test_one_missing_control_step_is_no_step():
    counter = StepCounter(1)
    walk(counter, "____-___----__-__---")
    assert counter.steps[0] == 1


def test_only_steps_that_begin_where_they_count():
    counter = StepCounter(1)
    walk(counter, "__---___", "   x", counted=~ALL)
    walk(counter, "---___---")
    assert (counter.steps[0], counter.dirty[0]) == (1, 0)


def test_a_fall_counts_the_step_that_it_ended_and_a_new_place_does_not():
    for fell in (True, False):
        counter = StepCounter(1)
        walk(counter, "__---", "   x")
        counter.restart(ALL, np.array([fell]))
        walk(counter, "__---__---")
        assert (counter.steps[0], counter.dirty[0]) == ((2, 1) if fell else (1, 0))
