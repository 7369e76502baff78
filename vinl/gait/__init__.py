"""Gait clock, footholds chosen on a map, and swing paths: one planner for training, evaluation and robot."""
