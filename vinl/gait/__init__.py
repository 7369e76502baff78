"""Gait clock, footholds chosen on a map, and swing paths: one planner for training, evaluation and robot.

In every control step, after the robot has moved::

    feet = feet_in_heading_frame(xp, qpos)
    command = adapt_command(xp, config, view, command, feet)                       # not in training
    gait = tick(xp, config, gait, motion, command, feet)                           # clocks run, feet lift off
    plan = plan_footholds(xp, config, view, gait, velocity, command, feet)         # from a map, or by a network
    gait = aim(xp, config, gait, plan, velocity, command, feet)                    # feet have a target
    rows = gait_rows(xp, config, gait, feet)                                       # what a policy observes of it

``plan`` is the code between seeing and walking: 20 numbers, four feet with a foothold's offset along and across, its
height, the height of the swing's apex, and how fast the leg's clock runs. Whoever knows no map lets a network predict
them, and the velocity that ``motion`` and ``velocity`` are made of.
"""
